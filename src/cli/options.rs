//! Options that several commands share.

use std::borrow::Cow;
use std::fmt::Display;
use std::ops::{Deref, RangeInclusive};
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::Arc;

use anyhow::Error;
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use symbolt::files::Limit;
use symbolt::neurons::Population;
use symbolt::sim::Seed;
use symbolt::spa::{Algebra, Hrr};
use symbolt::task::classify::{Classifier, ClassifierRule};
use symbolt::task::domain::RelationalDomain;
use symbolt::task::learn::Method;
use symbolt::task::planner::{PlannerBuild, PlannerKind, PlannerSpec, Unbinding};
use symbolt::task::tasks::file::DataTask;
use symbolt::task::tasks::nuts_and_bolts::{NutsAndBolts, Order, SyntheticDemonstrations};
use symbolt::task::tasks::{self, Task};
use symbolt::task::{Commitment, Sensing, TaskError};

use super::end::BadArgument;
use super::kind::{Given, Kind, parsed};
use super::rank;

/// Options of nearly every command.
#[derive(Debug, Clone, Args)]
pub(crate) struct Common {
    /// Seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = within(0..=u64::MAX))]
    pub seed: u64,
    #[command(flatten)]
    pub seedless: Seedless,
}

impl Deref for Common {
    type Target = Seedless;

    fn deref(&self) -> &Seedless {
        &self.seedless
    }
}

/// Those of the options that a command without random numbers has as well.
#[derive(Debug, Clone, Args)]
pub(crate) struct Seedless {
    /// Worker threads, 0 for one per core; results do not change
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = within(0..=1024_usize))]
    pub threads: usize,
    /// Do not print progress to standard error
    #[arg(long)]
    pub quiet: bool,
    /// Print JSON instead of tables
    #[arg(long)]
    pub json: bool,
}

/// The output file.
#[derive(Debug, Clone, Args)]
pub(crate) struct OutFile {
    /// File to write; it must not exist; - for standard output
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Replace the file if it exists
    #[arg(long)]
    pub force: bool,
}

/// Options of the planner graph.
#[derive(Debug, Clone, Args)]
pub(crate) struct PlannerArgs {
    /// Planner: goal-sets (whole goal sets, neurons alone) or chain (one
    /// state at a time, as in the paper) [default: goal-sets]
    #[arg(verbatim_doc_comment, long = "planner", value_name = "NAME", value_parser = kind)]
    pub kind: Option<PlannerKind>,
    /// Mode of the layers: direct, rate or lif (spiking)
    #[arg(long, default_value = "direct")]
    pub mode: String,
    /// Dimensions of the pointers of the planner chain; it uses more if the
    /// scene needs them [default: 256]
    #[arg(verbatim_doc_comment, long, value_name = "N", value_parser = whole::<usize>)]
    pub dimensions: Option<usize>,
    /// Also require the absence of states that never held before an action
    #[arg(verbatim_doc_comment, long)]
    pub absent: bool,
    /// Let the planner chain take the first possible action (the paper's
    /// rule); by default it first shows that the goal can be reached
    #[arg(verbatim_doc_comment, long)]
    pub first: bool,
    /// Let the planner chain unbind with a layer of products, not with a
    /// fixed linear map
    #[arg(verbatim_doc_comment, long)]
    pub products: bool,
}

fn kind(name: &str) -> Result<PlannerKind, String> {
    let found = PlannerKind::ALL.into_iter().find(|kind| kind.name() == name);
    found.ok_or_else(|| {
        let names = PlannerKind::ALL.map(PlannerKind::name).join(" or ");
        format!("there is no planner of this name; expected {names}")
    })
}

impl PlannerArgs {
    /// Checks the options, so that a wrong option is refused before any work.
    ///
    /// # Errors
    /// If the mode or the dimensions cannot be used.
    pub fn check(&self) -> Result<(), Error> {
        self.mode.parse::<Population>()?;
        if self.kind() == PlannerKind::GoalSets {
            self.check_goal_sets(", or add --planner chain")?;
        }
        Ok(Hrr.check_dim(self.dimensions()).map_err(TaskError::from)?)
    }

    /// Returns which planner is wanted for a learned domain.
    pub fn kind(&self) -> PlannerKind {
        self.kind.unwrap_or_default()
    }

    /// Returns how the planner is built.
    pub fn build(&self, seed: u64) -> Result<PlannerBuild, Error> {
        let build = PlannerBuild::new(self.kind(), &self.mode.parse()?, Seed::new(seed))?;
        Ok(PlannerBuild { spec: self.spec(), plan: rank::shared(build.plan), ..build })
    }

    /// Returns what the planner counts during a decision, and what its milestones are numbered by.
    pub fn counts(&self) -> [&'static str; 2] {
        match self.kind() {
            PlannerKind::Chain => ["question"; 2],
            PlannerKind::GoalSets => ["goal set", "step"],
        }
    }

    /// Refuses the options that the planner of goal sets does not have. `instead` says what else to do.
    pub fn check_goal_sets(&self, instead: &str) -> Result<(), BadArgument> {
        let given = [
            ("--dimensions", self.dimensions.is_some()),
            ("--first", self.first),
            ("--products", self.products),
        ];
        match given.iter().find(|(_, given)| *given) {
            None => Ok(()),
            Some((option, _)) => Err(BadArgument(format!(
                "{option} has no effect on the planner goal-sets; leave it out{instead}"
            ))),
        }
    }

    /// Returns the number of dimensions.
    pub fn dimensions(&self) -> usize {
        self.dimensions.unwrap_or(PlannerSpec::default().dimensions)
    }

    /// Returns the domain that is planned with.
    pub fn domain<'d>(&self, domain: &'d RelationalDomain) -> Cow<'d, RelationalDomain> {
        match self.absent {
            true => Cow::Owned(domain.with_unseen_absent()),
            false => Cow::Borrowed(domain),
        }
    }

    pub fn spec(&self) -> PlannerSpec {
        PlannerSpec {
            dimensions: self.dimensions(),
            commitment: if self.first { Commitment::First } else { Commitment::Proven },
            unbinding: if self.products { Unbinding::Products } else { Unbinding::Fixed },
            ..PlannerSpec::default()
        }
    }
}

/// The learner's methods by name.
pub(crate) const METHODS: [(&str, Method); 2] =
    [("relational", Method::Relational), ("paper", Method::Paper)];

/// The rules that find the state of an object, by name. The first takes `--limit`.
const RULES: [(&str, Rule); 2] = [("gated", Rule::Gated), ("nearest", Rule::Nearest)];

/// The rule that finds the state of an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rule {
    Gated,
    Nearest,
}

#[derive(Debug, Clone, Args)]
pub(crate) struct GroundingArgs {
    /// Rule that finds an object's state: gated (the greatest density within
    /// --limit) or nearest (by p-norm, the paper's rule)
    #[arg(verbatim_doc_comment, hide_possible_values = true)]
    /// [default: gated]
    #[arg(long, value_name = "RULE", value_parser = named(&RULES))]
    pub grounding: Option<Rule>,
    /// Maximum distance to a state, in standard deviations [default: 5]
    #[arg(long, value_name = "SD", value_parser = number::<f64>)]
    pub limit: Option<f64>,
}

impl GroundingArgs {
    /// Returns the classifier of a domain.
    ///
    /// # Errors
    /// [`BadArgument`] for a limit that the rule does not have; [`TaskError::Setting`] for a limit out of range.
    pub fn classifier(&self, domain: &RelationalDomain) -> Result<Classifier, Error> {
        let rule = match (self.grounding.unwrap_or(Rule::Gated), self.limit) {
            (Rule::Gated, limit) => {
                ClassifierRule::Gated { limit: limit.unwrap_or(Classifier::LIMIT) }
            }
            (Rule::Nearest, None) => ClassifierRule::paper(),
            (Rule::Nearest, Some(_)) => return Err(unused("--limit", "--grounding gated").into()),
        };
        Ok(Classifier::new(domain).with_rule(rule)?)
    }
}

/// Refuses an option that would have no effect.
pub(crate) fn unused(option: &str, needs: &str) -> BadArgument {
    BadArgument(format!("{option} has an effect with {needs} only; leave it out"))
}

/// The parts that can go into the jig first, by name.
const ORDERS: [(&str, Order); 3] =
    [("nut-first", Order::NutFirst), ("bolt-first", Order::BoltFirst), ("either", Order::Either)];

/// The task.
#[derive(Debug, Clone, Args)]
pub(crate) struct TaskArgs {
    /// Task; without a name the tasks are listed [default: nuts-and-bolts]
    #[arg(verbatim_doc_comment, long, value_name = "NAME", num_args = 0..=1)]
    #[arg(default_missing_value = "", conflicts_with = "task_file")]
    pub task: Option<String>,
    /// JSON file that describes a task
    #[arg(long, value_name = "FILE")]
    pub task_file: Option<PathBuf>,
}

impl TaskArgs {
    /// Returns whether the tasks are to be listed.
    pub fn listed(&self) -> bool {
        self.task.as_deref() == Some("")
    }

    /// Returns the task with its default settings.
    pub fn task(&self) -> Result<Arc<dyn Task>, Error> {
        match (&self.task_file, &self.task) {
            (Some(path), _) => {
                let file = Given { path, takes: &[Kind::Task] };
                Ok(Arc::new(parsed(file, Limit::SETTINGS, &[], DataTask::parse)?))
            }
            (None, Some(name)) => Ok(tasks::by_name(name)?),
            (None, None) => Ok(tasks::default()),
        }
    }

    /// Returns whether this is the task with nuts and bolts, which has options of its own.
    fn has_nuts(&self) -> bool {
        let own = NutsAndBolts::default();
        self.task_file.is_none() && self.task.as_ref().is_none_or(|name| name == own.name())
    }
}

/// Options of demonstrations.
#[derive(Debug, Clone, Args)]
pub(crate) struct DemoArgs {
    #[command(flatten)]
    pub task: TaskArgs,
    /// Number of demonstrations, at most 1000; at most 10000 with
    /// `record --kinematic`
    #[arg(verbatim_doc_comment, long, value_name = "N", default_value_t = 5, value_parser = whole::<usize>)]
    pub demos: usize,
    /// Nuts per demonstration, 1 to 4 [default: as in --config, or 1]
    #[arg(long, value_name = "N", value_parser = whole::<usize>)]
    pub demo_nuts: Option<usize>,
    /// Bolts per demonstration, 1 to 4 [default: as in --config, or 1]
    #[arg(long, value_name = "N", value_parser = whole::<usize>)]
    pub demo_bolts: Option<usize>,
    /// JSON file with scene settings; `symbolt config` prints the defaults
    #[arg(long, value_name = "FILE")]
    pub config: Option<PathBuf>,
    #[command(flatten)]
    pub sensing: SensingArgs,
}

/// Maximum number of demonstrations in physics, and without it. A longer recording of the built-in tasks could not be
/// read again.
const MAX_DEMOS: usize = 1_000;
const MAX_KINEMATIC_DEMOS: usize = 10_000;

impl DemoArgs {
    /// Checks the number of demonstrations.
    ///
    /// # Errors
    /// [`BadArgument`] if it is 0, more than [`MAX_DEMOS`] or, without physics, more than [`MAX_KINEMATIC_DEMOS`].
    pub fn check(&self, kinematic: bool) -> Result<(), BadArgument> {
        let most = if kinematic { MAX_KINEMATIC_DEMOS } else { MAX_DEMOS };
        match (1..=most).contains(&self.demos) {
            true => Ok(()),
            false => Err(BadArgument::range("--demos", self.demos, &format!("1 to {most}"))),
        }
    }

    /// Returns the task to demonstrate.
    pub fn task(&self) -> Result<Arc<dyn Task>, Error> {
        let options = [("--demo-nuts", self.demo_nuts), ("--demo-bolts", self.demo_bolts)];
        let named = |error: Error| error.downcast().map_or_else(|other| other, demonstrated);
        self.with_parts(options).map_err(named)
    }

    /// Returns the task with the settings of the configuration file, and with these numbers of nuts and bolts. Each
    /// number comes with the name of its option.
    ///
    /// # Errors
    /// [`BadArgument`] if a number is given and the task has no nuts and bolts.
    pub fn with_parts(&self, parts: [(&str, Option<usize>); 2]) -> Result<Arc<dyn Task>, Error> {
        let takes: &[Kind] = match self.task.has_nuts() {
            true => &[Kind::Settings],
            false => &[Kind::Settings, Kind::Task],
        };
        let settings = self.config.as_deref().map(|path| Given { path, takes });
        if self.task.has_nuts() {
            let mut spec = match settings {
                Some(settings) => parsed(settings, Limit::SETTINGS, &[], NutsAndBolts::parse)?,
                None => NutsAndBolts::default(),
            };
            let [(_, nuts), (_, bolts)] = parts;
            spec.nuts = nuts.unwrap_or(spec.nuts);
            spec.bolts = bolts.unwrap_or(spec.bolts);
            spec.check()?;
            return Ok(Arc::new(spec));
        }
        let task = self.task.task()?;
        if let Some((option, _)) = parts.iter().find(|(_, count)| count.is_some()) {
            let problem = format!(
                "{option} belongs to the task nuts-and-bolts; the task {} has its settings in --config",
                task.name()
            );
            return Err(BadArgument(problem).into());
        }
        Ok(match settings {
            None => task,
            Some(settings) => parsed(settings, Limit::SETTINGS, &[], |bytes, name| {
                task.with_settings(bytes, name)
            })?,
        })
    }
}

/// Errors of sensing.
#[derive(Debug, Clone, Args)]
pub(crate) struct SensingArgs {
    /// Noise of all poses: standard deviation of each coordinate in mm and of
    /// the orientation in degrees, such as 1,1
    #[arg(verbatim_doc_comment, long, value_name = "MM,DEG")]
    pub pose_noise: Option<String>,
    /// Probability that a pose is an outlier, 0 to 1
    #[arg(long, value_name = "RATE", default_value_t = 0.0, value_parser = number::<f64>)]
    pub outliers: f64,
    /// Probability that an object is missing from a snapshot,
    /// 0 to 1
    #[arg(verbatim_doc_comment, long, value_name = "RATE", default_value_t = 0.0, value_parser = number::<f64>)]
    pub missing: f64,
    /// Probability that two objects of a kind exchange their ids in a
    /// snapshot, 0 to 1
    #[arg(verbatim_doc_comment, long, value_name = "RATE", default_value_t = 0.0)]
    #[arg(value_parser = number::<f64>)]
    pub swaps: f64,
}

impl SensingArgs {
    /// Returns the errors of sensing.
    ///
    /// # Errors
    /// [`BadArgument`] for a value out of range.
    pub fn sensing(&self) -> Result<Sensing, BadArgument> {
        let mut sensing = Sensing {
            outlier_rate: self.outliers,
            missing_rate: self.missing,
            swap_rate: self.swaps,
            ..Sensing::default()
        };
        if let Some(typed) = &self.pose_noise {
            let refused = || {
                let expected =
                    "MM,DEG, two numbers of at least 0 such as 1,1 (up to 1000 mm and 180 degrees)";
                BadArgument::range("--pose-noise", typed, expected)
            };
            let (mm, deg) = typed.split_once(',').ok_or_else(refused)?;
            let read = |text: &str| text.trim().parse::<f64>().map_err(|_| refused());
            sensing.pose_noise_m = read(mm)? * 1e-3;
            sensing.pose_noise_deg = read(deg)?;
            let fits = (0.0..=1.0).contains(&sensing.pose_noise_m)
                && (0.0..=180.0).contains(&sensing.pose_noise_deg);
            if !fits {
                return Err(refused());
            }
        }
        let rates =
            [("--outliers", self.outliers), ("--missing", self.missing), ("--swaps", self.swaps)];
        match rates.iter().find(|(_, rate)| !(0.0..=1.0).contains(rate)) {
            Some((option, rate)) => Err(BadArgument::range(option, rate, "0 to 1")),
            None => Ok(sensing),
        }
    }

    /// Returns the seed of the errors in recorded demonstrations.
    pub fn seed(seed: u64) -> Seed {
        Seed::new(seed).derive("", "sensing")
    }
}

/// Names the option of demonstrations in an error about their task.
pub(crate) fn demonstrated(error: TaskError) -> Error {
    match error {
        TaskError::Setting { name: name @ ("nuts" | "bolts"), value, expected } => {
            BadArgument::range(&format!("--demo-{name}"), value, expected).into()
        }
        other => other.into(),
    }
}

/// Options of the generator without physics.
#[derive(Debug, Clone, Args)]
pub(crate) struct SyntheticArgs {
    /// Part that goes into the jig first: nut-first, bolt-first
    /// or either (at random)
    #[arg(verbatim_doc_comment, hide_possible_values = true)]
    #[arg(long, default_value = "either", requires = "kinematic", value_parser = named(&ORDERS))]
    pub order: Order,
    /// Probability that an attempt fails, 0 to 0.9
    #[arg(long, value_name = "RATE", default_value_t = 0.0, value_parser = number::<f64>)]
    #[arg(requires = "kinematic", conflicts_with = "scene")]
    pub fail_rate: f64,
    /// Probability that a failed attempt loses its part, 0 to 1
    #[arg(long, value_name = "RATE", default_value_t = 0.0, value_parser = number::<f64>)]
    #[arg(requires = "kinematic", conflicts_with = "scene")]
    pub loss_rate: f64,
    /// Probability that an attempt moves another part, 0 to 1
    #[arg(long, value_name = "RATE", default_value_t = 0.0, value_parser = number::<f64>)]
    #[arg(requires = "kinematic", conflicts_with = "scene")]
    pub knock_rate: f64,
    /// Leave out times, events and touched objects
    #[arg(long, requires = "kinematic", conflicts_with = "scene")]
    pub no_events: bool,
}

impl SyntheticArgs {
    pub fn synthetic(&self, demos: &DemoArgs) -> SyntheticDemonstrations {
        SyntheticDemonstrations {
            demos: demos.demos,
            nuts: demos.demo_nuts.unwrap_or(1),
            bolts: demos.demo_bolts.unwrap_or(1),
            order: self.order,
            fail_rate: self.fail_rate,
            loss_rate: self.loss_rate,
            knock_rate: self.knock_rate,
            events: !self.no_events,
        }
    }
}

/// Reads one of several names.
pub(crate) fn named<T: Copy + Send + Sync>(
    choices: &'static [(&'static str, T)],
) -> impl TypedValueParser<Value = T> {
    let names = PossibleValuesParser::new(choices.iter().map(|(name, _)| *name));
    names.try_map(|name| {
        let chosen = choices.iter().find(|(known, _)| *known == name);
        chosen.map(|(_, choice)| *choice).ok_or("must be one of the names")
    })
}

/// Reads a whole number of a range.
pub(crate) fn within<T>(
    range: RangeInclusive<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Display + Clone + Send + Sync + 'static,
{
    move |typed| {
        let number = typed.parse().ok().filter(|number| range.contains(number));
        let what = if typed.parse::<i128>().is_err() { "a whole number, " } else { "" };
        number.ok_or_else(|| format!("must be {what}{} to {}", range.start(), range.end()))
    }
}

/// Reads a whole number.
pub(crate) fn whole<T: FromStr>(typed: &str) -> Result<T, &'static str> {
    typed.parse().map_err(|_| "must be a whole number, 0 or more")
}

/// Reads a number.
pub(crate) fn number<T: FromStr>(typed: &str) -> Result<T, &'static str> {
    typed.parse().map_err(|_| "must be a number")
}
