//! `symbolt classify`: the state of every object in a recording or scene.

use std::fmt::{self, Display};
use std::path::PathBuf;

use anyhow::Error;
use clap::Args;
use serde_json::{Value, json};
use symbolt::files::Limit;
use symbolt::task::classify::{Classifier, Layout, Located};
use symbolt::task::domain::{Fact, RelationalDomain, SubKinds};
use symbolt::task::event::InNoState;
use symbolt::task::{ObjectPose, Recording, Snapshot};

use super::end::Outcome;
use super::kind::{Given, Kind, parsed};
use super::look::known;
use super::options::{Common, GroundingArgs, OutFile};
use super::output::{not_both_standard_input, use_threads, warn};
use super::table::{Grid, counted};

/// Most objects of which a warning tells that their attributes are unknown.
const MOST_WARNED: usize = 5;

#[derive(Debug, Clone, Args)]
pub(crate) struct ClassifyArgs {
    /// Learned domain; - for standard input
    pub domain: PathBuf,
    /// Recording or scene; - for standard input
    pub recording: PathBuf,
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub grounding: GroundingArgs,
    #[command(flatten)]
    pub out: OutFile,
}

/// The state of an object in a snapshot.
struct Row<'a> {
    /// Numbers of the demonstration and the snapshot; `None` for a single scene.
    place: Option<(u64, u64)>,
    object: &'a ObjectPose,
    located: &'a Located,
    state: Option<&'a str>,
    /// The statement that the object is in the state.
    words: Option<String>,
    /// The nearest state of a part in no state.
    miss: Option<InNoState>,
    /// Id of the reference; `None` in the world frame and for an object in no state.
    reference: Option<&'a str>,
}

/// The snapshots to classify.
struct Scenes {
    recording: Recording,
    /// Whether it is a single scene, which has no numbers.
    single: bool,
}

pub(crate) fn classify(args: &ClassifyArgs) -> Result<Outcome, Error> {
    let out = args.out.place()?;
    use_threads(&args.common)?;
    not_both_standard_input(("domain", &args.domain), ("recording", &args.recording))?;
    let domain = Given { path: &args.domain, takes: &[Kind::Domain] };
    let seen = Given { path: &args.recording, takes: &[Kind::Recording, Kind::Scene] };
    let domain = parsed(domain, Limit::DOMAIN, &[seen], RelationalDomain::parse)?;
    let classifier = args.grounding.classifier(&domain)?;
    let scenes = Scenes::read(seen, &domain.sub_kinds)?;
    let snapshots = scenes.recording.demos.iter().flat_map(|demo| &demo.snapshots);
    known(&domain, snapshots.flat_map(|seen| &seen.objects).map(|object| &*object.kind))?;
    let found = Found { scenes: &scenes, domain: &domain, classifier: &classifier };
    if args.common.json { out.write(found) } else { out.write(found.table()) }
}

fn json(row: &Row<'_>) -> Value {
    let (demo, snapshot) = row.place.unzip();
    let mut keys = json!({
        "demo": demo, "snapshot": snapshot, "id": row.object.id, "kind": row.object.kind,
        "state": row.state, "words": row.words, "distance": row.located.distance, "reference": row.reference,
        "place": row.located.fact.map(|fact| fact.place), "ambiguous": row.located.ambiguous,
    });
    if let Some(miss) = &row.miss {
        keys["nearest"] = json!(miss.nearest);
        keys["off_mm"] = json!(miss.off_mm);
        keys["off_deg"] = json!(miss.off_deg);
    }
    keys
}

impl Scenes {
    /// Reads all snapshots of a recording, or the only one of a scene.
    fn read(given: Given<'_>, sub_kinds: &[SubKinds]) -> Result<Self, Error> {
        let read = |bytes: &[u8], name: &str| match Recording::parse_whole(bytes, name) {
            Ok((recording, _, attributes)) => Ok((recording, attributes, false)),
            Err(fault) => match Snapshot::parse_attributed(bytes, name) {
                Ok((scene, attributes)) => Ok((Recording::of_scene(scene), attributes, true)),
                Err(of_scene) if Kind::of(bytes).kind == Kind::Scene => Err(of_scene),
                Err(_) => Err(fault),
            },
        };
        let (mut recording, attributes, single) = parsed(given, Limit::RECORDING, &[], read)?;
        let left = SubKinds::apply(sub_kinds, &mut recording, &attributes);
        left.iter().take(MOST_WARNED).for_each(|left| warn(&left.to_string()));
        if left.len() > MOST_WARNED {
            let more = counted(left.len() - MOST_WARNED, "more object");
            warn(&format!("the attributes of {more} fit no part of their kind either"));
        }
        Ok(Self { recording, single })
    }
}

/// What is found in scenes. It displays as lines of JSON.
struct Found<'a> {
    scenes: &'a Scenes,
    domain: &'a RelationalDomain,
    classifier: &'a Classifier,
}

impl Found<'_> {
    /// Classifies with hysteresis along each demonstration, and gives every object to `each`. Nothing is kept: a long
    /// recording has many rows.
    fn rows(&self, mut each: impl FnMut(&Row<'_>) -> fmt::Result) -> fmt::Result {
        for demo in &self.scenes.recording.demos {
            let mut before: Option<Layout> = None;
            for scene in &demo.snapshots {
                let layout = match &before {
                    Some(layout) => self.classifier.classify_after(layout, scene),
                    None => self.classifier.classify(scene),
                };
                let names = layout.object_names();
                let all = layout.objects.iter().zip(&layout.located).enumerate();
                for (index, (object, located)) in all {
                    let in_words = |fact: &Fact| self.domain.fact_in_words(fact, index, &names);
                    let reference = located.fact.and_then(|fact| fact.reference);
                    let name = |state: usize| &*self.domain.states[state].name;
                    each(&Row {
                        place: (!self.scenes.single).then_some((demo.number, scene.number)),
                        object,
                        located,
                        state: located.fact.map(|fact| name(fact.state)),
                        words: located.fact.as_ref().map(in_words),
                        miss: located.miss.map(|miss| {
                            let (nearest, words) = (miss.nearest, in_words(&miss.nearest));
                            InNoState::new(&object.id, name(nearest.state), &miss.offset, words)
                        }),
                        reference: reference.map(|r| &*layout.objects[r].id),
                    })?;
                }
                before = Some(layout);
            }
        }
        Ok(())
    }

    fn table(&self) -> Grid {
        let mut grid =
            Grid::new(&[">demo", ">snapshot", "id", "kind", "state", ">distance", "nearest state"]);
        let mut missed = false;
        let text = |shown: Option<String>| shown.unwrap_or_else(|| "-".into());
        let _ = self.rows(|row| {
            missed |= row.miss.is_some();
            let (demo, snapshot) = row.place.unzip();
            let mark = if row.located.ambiguous { " (or another)" } else { "" };
            grid.row([
                text(demo.map(|n| n.to_string())),
                text(snapshot.map(|n| n.to_string())),
                row.object.id.to_string(),
                row.object.kind.to_string(),
                row.words.as_ref().map_or_else(|| "none".into(), |words| format!("{words}{mark}")),
                text(row.located.distance.map(|d| format!("{d:.3}"))),
                text(row.miss.as_ref().map(|miss| format!("{}: {}", miss.words, miss.off))),
            ]);
            Ok(())
        });
        // A column that is the same for all rows would only take room.
        if !missed {
            grid.leave_out("nearest state");
        }
        grid
    }
}

impl Display for Found<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        self.rows(|row| {
            write!(f, "{separator}{}", json(row))?;
            separator = "\n";
            Ok(())
        })
    }
}
