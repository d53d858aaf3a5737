//! One command in several processes: they must be alike, and they end together.

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Error, bail};
use symbolt::files::{Limit, read_file};
use symbolt::neurons::solver_signature;
use symbolt::sim::{Fingerprint, launched};

use super::end::{BadArgument, Ended};
use super::rank::own;

/// Checks that all processes run the same program with the same arguments, and that their processors solve decoders to the
/// same bits, unless the populations come from the file `load`. The simulator checks in every tick whether they also run
/// them to the same bits.
pub(crate) fn check_alike(load: Option<&Path>) -> Result<(), Error> {
    let Some(ranks) = own() else { return Ok(()) };
    let program = std::env::current_exe().context("cannot find the program itself")?;
    let mut hash = Fingerprint::default();
    hash.text(&format!("{:?}", std::env::args_os().skip(1).collect::<Vec<_>>()));
    let arguments = hash.value();
    let build = hash_of(&read_file(&program, Limit::MODEL)?);
    let (model, what) = match load {
        Some(path) => (
            hash_of(&read_file(path, Limit::MODEL)?),
            "loads another file than this one; expected the same for all",
        ),
        None => (
            solver_signature(),
            "solves other populations than this one, since its processor is of another kind; expected one kind, \
             or populations that were solved once with --save and are shared with --load",
        ),
    };
    for (number, what) in [
        (arguments, "has other arguments than this one; expected the same for all"),
        (build, "runs another build of symbolt than this one; expected the same for all"),
        (model, what),
    ] {
        if let Some(rank) = ranks.differs(number).map_err(Error::from)? {
            bail!(BadArgument(format!("rank {rank} {what}")));
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

/// Runs `main` and returns its exit code. If a launcher started several processes, they share the command; when it is
/// over, they end together.
#[cfg(feature = "mpi")]
pub(crate) fn together(command: &str, main: impl FnOnce() -> Ended) -> ExitCode {
    use symbolt::sim::{Failure, MpiSession};

    let launched = launched();
    if launched.processes == 1 || !SHARED.contains(&command) {
        return main().tell();
    }
    let session = match MpiSession::start() {
        Ok(session) => session,
        Err(error) => {
            // Every process has this error.
            let sentence = (launched.rank == 0).then(|| error.to_string());
            return Ended { code: 2, sentence }.tell();
        }
    };
    let rank = session.ranks().rank();
    super::rank::set(session.ranks());
    let message = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        super::output::tell(&format!("rank {rank} panicked; all ranks end"));
        message(panic);
    }));
    let Ended { code, sentence } = main();
    let failure = sentence.map(|sentence| Failure { code, sentence });
    ExitCode::from(session.end(failure, super::output::tell))
}

/// Runs `main` and returns its exit code. Without the feature `mpi` processes share nothing.
#[cfg(not(feature = "mpi"))]
pub(crate) fn together(command: &str, main: impl FnOnce() -> Ended) -> ExitCode {
    let count = launched().processes;
    if count > 1 && SHARED.contains(&command) {
        super::output::warn(&format!(
            "this process is one of {count}, but this build of symbolt cannot share a network among processes, so each \
             runs the whole; build it with --features mpi"
        ));
    }
    main().tell()
}
