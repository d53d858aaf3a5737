//! One command in several processes: the seat of this process, and how all of them end together.

use std::path::Path;
use std::process::ExitCode;
use std::sync::OnceLock;

use anyhow::{Context, Error};
use symbolt::files::{Limit, read_file};
use symbolt::neurons::{PopulationPlan, solver_signature};
use symbolt::sim::{Fingerprint, Ranks};

use super::args::BadArgument;

/// The seat of this process, if the command is shared.
static SEAT: OnceLock<Ranks> = OnceLock::new();

/// Returns the seat of this process, if several processes share the command.
pub(crate) fn seat() -> Option<&'static Ranks> {
    SEAT.get()
}

/// Returns whether this process writes: it is alone, or the first.
pub(crate) fn leads() -> bool {
    seat().is_none_or(|seat| seat.rank() == 0)
}

/// Shares the neurons of a plan among the processes that share the command.
pub(crate) fn shared(plan: PopulationPlan) -> PopulationPlan {
    // The first process records the spikes of all.
    seat().into_iter().fold(plan, |plan, seat| plan.shared(&seat.clone().with_events()))
}

/// Checks that all processes run the same program with the same arguments, and that their processors solve decoders to the
/// same bits, unless the populations come from the file `load`.
pub(crate) fn check_alike(load: Option<&Path>) -> Result<(), Error> {
    let Some(seat) = seat() else { return Ok(()) };
    let program = std::env::current_exe().context("cannot find the program itself")?;
    let mut hash = Fingerprint::default();
    hash.text(&format!("{:?}", std::env::args_os().skip(1).collect::<Vec<_>>()));
    let arguments = hash.value();
    let build = hash_of(&read_file(&program, Limit::MODEL)?);
    let (numbers, advice) = match load {
        Some(path) => (hash_of(&read_file(path, Limit::MODEL)?), "expected one file for all"),
        None => (solver_signature(), "solve the model once with --save and share it with --load"),
    };
    for (number, what) in [
        (arguments, "has other arguments than this one; expected the same for all".to_owned()),
        (
            build,
            "runs another build of symbolt than this one; expected the same for all".to_owned(),
        ),
        (
            numbers,
            format!("has other populations than this one, since its processor differs; {advice}"),
        ),
    ] {
        if let Some(rank) = seat.differs(number).map_err(Error::from)? {
            return Err(BadArgument(format!("rank {rank} {what}")).into());
        }
    }
    Ok(())
}

fn hash_of(bytes: &[u8]) -> u64 {
    let mut hash = Fingerprint::default();
    let (eights, rest) = bytes.as_chunks::<8>();
    eights.iter().for_each(|eight| {
        hash.number(u64::from_le_bytes(*eight));
    });
    rest.iter().for_each(|byte| {
        hash.number(u64::from(*byte));
    });
    hash.value()
}

/// The commands that processes can share. The others run alone in each process, as the shards of an experiment do.
const SHARED: [&str; 2] = ["bench", "run"];

/// Returns how many processes the launcher started, as its variables say: those of Open MPI, of MPICH and its kin, and of
/// `srun` for either.
fn launched() -> u64 {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse::<u64>().ok());
    let of = |rank: &str, size: &str| number(rank).and_then(|_| number(size));
    of("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE")
        .or_else(|| of("PMI_RANK", "PMI_SIZE"))
        .or_else(|| of("PMIX_RANK", "SLURM_STEP_NUM_TASKS"))
        .unwrap_or(1)
}

/// Runs `main` and returns its exit code. If a launcher started several processes, they share the command; when it is
/// over, they end together.
#[cfg(feature = "mpi")]
pub(crate) fn together(command: &str, main: impl FnOnce() -> Ended) -> ExitCode {
    use std::time::Duration;
    use symbolt::sim::MpiSession;

    let session = (launched() > 1 && SHARED.contains(&command)).then(MpiSession::start).flatten();
    let Some(session) = session else { return main().tell() };
    let rank = session.ranks().rank();
    let _ = SEAT.set(session.ranks());
    let message = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        eprintln!("symbolt: rank {rank} panicked; all ranks end");
        message(panic);
    }));
    let ended = main();
    let Ended { code, sentence } = &ended;
    // An error that all share is told once. An error of one ends the others, which may wait for it.
    if sentence.is_none() || session.all_end(Duration::from_secs(1)) {
        let code = ExitCode::from(*code);
        // Told first: once MPI has ended, the launcher may end this process because of the exit code of another one.
        let code = if rank == 0 { ended.tell() } else { code };
        session.end();
        return code;
    }
    let code = i32::from(*code);
    Ended { sentence: ended.sentence.map(|sentence| format!("rank {rank}: {sentence}")), ..ended }
        .tell();
    session.abort(code)
}

/// Runs `main` and returns its exit code. Without the feature `mpi` processes share nothing.
#[cfg(not(feature = "mpi"))]
pub(crate) fn together(command: &str, main: impl FnOnce() -> Ended) -> ExitCode {
    let count = launched();
    if count > 1 && SHARED.contains(&command) {
        super::output::warn(&format!(
            "this process is one of {count}, but this build of symbolt cannot share a network among processes, so each \
             runs the whole; build it with --features mpi"
        ));
    }
    main().tell()
}

/// How a command ended.
pub(crate) struct Ended {
    /// Exit code.
    pub code: u8,
    /// What to say on standard error.
    pub sentence: Option<String>,
}

impl Ended {
    /// Says the sentence, if there is one, and returns the exit code.
    fn tell(self) -> ExitCode {
        if let Some(sentence) = self.sentence {
            super::complain(&sentence);
        }
        ExitCode::from(self.code)
    }
}
