//! The seam between emit and commit: shares of the parts, and the threads that compute them.
//!
//! Each thread owns a share of the parts, with their states, for the whole run. Parts are assigned one by one, each to
//! the share with the least work so far, so that neighbours, which a closed gate silences together, lie in different
//! shares. In each tick the calling thread lends the values that parts read to the workers, computes its own share, and
//! waits. A share that its thread has not begun by then is computed by the caller: a busy core then costs time, but no
//! tick waits for a thread that sleeps.
//!
//! Threads without work spin for [`SPIN`], then sleep. Waking one costs the caller some microseconds.

use std::ops::Deref;
use std::panic::{self, AssertUnwindSafe};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering::SeqCst};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock, RwLockReadGuard, mpsc};
use std::thread::{self, JoinHandle, Thread};
use std::time::{Duration, Instant};

use crate::sim::build::graph::Graph;
use crate::sim::describe::io::ScratchArena;
use crate::sim::describe::parts::{Batch, Item};
use crate::sim::real::{Real, Span};
use crate::sim::run::stage::Stage;

/// Time for which a thread without work looks for more before it sleeps.
const SPIN: Duration = Duration::from_micros(100);

/// The parts of one node in a share.
#[derive(Debug, Clone, Copy)]
struct Run {
    /// Index in [`Graph::divided`].
    divided: u32,
    /// Range in the items of the share.
    items: Span,
}

/// Parts that one thread computes, with their states.
#[derive(Default)]
struct Share {
    runs: Vec<Run>,
    items: Vec<Item>,
    /// For each item, its index in [`Graph::parts`].
    parts: Vec<u32>,
    state: Vec<Real>,
    scratch: ScratchArena,
    work: u64,
}

/// Assigns the parts of `graph` that rank `rank` computes among `threads` shares. Returns the shares, and for each part
/// its share and its index in the share.
fn assign(graph: &Graph, rank: usize, threads: usize) -> (Vec<Share>, Vec<Option<(u32, u32)>>) {
    let mut shares: Vec<Share> = (0..threads).map(|_| Share::default()).collect();
    let mut places = vec![None; graph.parts.len()];
    let mut order: Vec<usize> =
        (0..graph.parts.len()).filter(|part| graph.parts[*part].rank as usize == rank).collect();
    // The largest first: a large one at the end would leave the others idle.
    order.sort_by_key(|part| std::cmp::Reverse(graph.parts[*part].work));
    let mut owned: Vec<Vec<usize>> = vec![Vec::new(); threads];
    for part in order {
        let least = (0..threads).min_by_key(|share| shares[*share].work).unwrap_or(0);
        shares[least].work += u64::from(graph.parts[part].work);
        owned[least].push(part);
    }
    for (index, (share, mut parts)) in shares.iter_mut().zip(owned).enumerate() {
        // In the order of memory.
        parts.sort_unstable();
        let mut states = 0;
        for part in parts {
            let plan = &graph.parts[part];
            let (len, at) = (plan.state.len(), share.items.len() as u32);
            places[part] = Some((index as u32, at));
            match share.runs.last_mut() {
                Some(run) if run.divided == plan.divided => run.items.end = at + 1,
                _ => {
                    let items = Span { start: at, end: at + 1 };
                    share.runs.push(Run { divided: plan.divided, items });
                }
            }
            share.parts.push(part as u32);
            share.items.push(Item {
                part: plan.index,
                state: Span { start: states as u32, end: (states + len) as u32 },
                results: plan.results,
                own_results: plan.own_results() as u32,
                units: plan.units.len() as u32,
            });
            states += len;
        }
        share.state = vec![0.0; states];
        share.scratch = ScratchArena::new(&graph.sizes.scratch);
    }
    (shares, places)
}

impl Share {
    /// Advances all parts of the share. The results of each part go to its range in `results`.
    fn run(&mut self, graph: &Graph, stage: &Stage, results: &mut [Real]) {
        for run in &self.runs {
            let plan = &graph.divided[run.divided as usize];
            let node = plan.node as usize;
            let Some(parts) = graph.bodies[node].parts() else { continue };
            let batch = Batch {
                items: &self.items[run.items.of()],
                inputs: stage.inputs(&graph.slots[plan.slots.of()]),
                state: &mut self.state,
                results: &mut *results,
                scratch: self.scratch.lend(plan.scratch),
            };
            parts.advance_all(&stage.cx(node), batch);
        }
    }
}

/// The share of a worker, with its results.
struct Assignment {
    share: Share,
    results: Vec<Real>,
}

/// A thread beside the calling one, and what it computes.
struct Worker {
    assignment: Mutex<Assignment>,
    /// The last tick for which somebody took the share.
    taken: AtomicU64,
    asleep: AtomicBool,
}

struct Shared {
    graph: Arc<Graph>,
    /// What the workers read in a tick. The caller lends its own for the time of the tick.
    stage: RwLock<Stage>,
    workers: Vec<Worker>,
    /// Number of ticks begun. Each assignment is taken once in each.
    tick: AtomicU64,
    done: AtomicUsize,
    failed: AtomicBool,
    stop: AtomicBool,
}

/// Counts a share as done, also if its node panics.
struct Done<'a>(&'a Shared);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.failed.store(true, SeqCst);
        }
        self.0.done.fetch_add(1, SeqCst);
    }
}

impl Shared {
    fn stage(&self) -> RwLockReadGuard<'_, Stage> {
        self.stage.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// Computes a share, unless somebody else has taken it. A caller that holds the lock of the stage hands it over: to
    /// take it twice on one thread may block for ever.
    fn run<S: Deref<Target = Stage>>(&self, index: usize, tick: u64, stage: impl FnOnce() -> S) {
        let worker = &self.workers[index];
        if !worker.take(tick) {
            return;
        }
        let _done = Done(self);
        let stage = stage();
        let mut assignment = worker.lock();
        let Assignment { share, results } = &mut *assignment;
        share.run(&self.graph, &stage, results);
    }

    /// Computes the share `index` in every tick until the workers are dismissed.
    fn serve(&self, index: usize) {
        let mut seen = 0;
        loop {
            let since = Instant::now();
            let mut spins = 0u32;
            while self.tick.load(SeqCst) == seen {
                spins += 1;
                std::hint::spin_loop();
                if spins.is_multiple_of(64) && since.elapsed() > SPIN {
                    let asleep = &self.workers[index].asleep;
                    asleep.store(true, SeqCst);
                    // Looking again after the announcement: otherwise a tick begun in between would wake nobody.
                    if self.tick.load(SeqCst) == seen {
                        thread::park();
                    }
                    asleep.store(false, SeqCst);
                }
            }
            // In this order: the workers are dismissed by `stop`, then by one more tick, in which nothing may be computed.
            seen = self.tick.load(SeqCst);
            if self.stop.load(SeqCst) {
                return;
            }
            self.run(index, seen, || self.stage());
        }
    }
}

impl Worker {
    /// Takes the share for this tick. Returns `false` if somebody else has.
    fn take(&self, tick: u64) -> bool {
        self.taken.compare_exchange(tick - 1, tick, SeqCst, SeqCst).is_ok()
    }

    fn lock(&self) -> MutexGuard<'_, Assignment> {
        self.assignment.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The other threads of a run. They live as long as their simulator.
struct Workers {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
    wake: Vec<Thread>,
}

impl Workers {
    fn new(graph: &Arc<Graph>, shares: Vec<Share>) -> Self {
        let worker = |mut share: Share| {
            let mut end = 0;
            for item in &mut share.items {
                let start = end;
                end += item.results.len() as u32;
                item.results = Span { start, end };
            }
            Worker {
                assignment: Mutex::new(Assignment { share, results: vec![0.0; end as usize] }),
                taken: AtomicU64::new(0),
                asleep: AtomicBool::new(false),
            }
        };
        let shared = Arc::new(Shared {
            graph: graph.clone(),
            stage: RwLock::default(),
            workers: shares.into_iter().map(worker).collect(),
            tick: AtomicU64::new(0),
            done: AtomicUsize::new(0),
            failed: AtomicBool::new(false),
            stop: AtomicBool::new(false),
        });
        // Where no thread can be had, the caller computes its share.
        let (started, starts) = mpsc::channel();
        let start = |index: usize| {
            let (shared, started) = (shared.clone(), started.clone());
            let serve = move || {
                // `new` waits for all of them, so the receiver is there.
                let _ = started.send(());
                drop(started);
                shared.serve(index);
            };
            let thread = thread::Builder::new().name(format!("symbolt-{}", index + 1));
            thread.spawn(serve).ok()
        };
        let threads: Vec<_> = (0..shared.workers.len()).map_while(start).collect();
        // The first steps of a thread allocate. On a busy machine they would otherwise fall into a tick.
        starts.iter().take(threads.len()).for_each(drop);
        let wake = threads.iter().map(|thread| thread.thread().clone()).collect();
        Self { shared, threads, wake }
    }

    /// Exchanges the caller's stage with that of the workers.
    fn swap(&self, stage: &mut Stage) {
        std::mem::swap(
            &mut *self.shared.stage.write().unwrap_or_else(PoisonError::into_inner),
            stage,
        );
    }

    /// Lends the values that parts read, and begins a tick: everybody may compute.
    fn begin(&self, stage: &mut Stage) -> u64 {
        self.swap(stage);
        self.shared.done.store(0, SeqCst);
        self.shared.failed.store(false, SeqCst);
        let tick = self.shared.tick.fetch_add(1, SeqCst) + 1;
        self.wake();
        tick
    }

    fn wake(&self) {
        for (thread, worker) in self.wake.iter().zip(&self.shared.workers) {
            if worker.asleep.swap(false, SeqCst) {
                thread.unpark();
            }
        }
    }

    /// Computes what nobody has begun, and waits for the rest.
    ///
    /// # Panics
    /// If a node panicked on another thread.
    fn finish(&self, tick: u64, stage: &Stage) {
        let shared = &self.shared;
        (0..shared.workers.len()).for_each(|index| shared.run(index, tick, || stage));
        self.wait();
        assert!(!shared.failed.load(SeqCst), "a node panicked on another thread of the run");
    }

    /// Copies the results of the workers' parts to their ranges in `results`.
    fn collect(&self, graph: &Graph, results: &mut [Real]) {
        for worker in &self.shared.workers {
            let assignment = worker.lock();
            for (part, item) in assignment.share.parts.iter().zip(&assignment.share.items) {
                let into = &mut results[graph.parts[*part as usize].results.of()];
                into.copy_from_slice(&assignment.results[item.results.of()]);
            }
        }
    }

    /// Leaves out what nobody has begun, and waits for the rest.
    fn abandon(&self, tick: u64) {
        for worker in &self.shared.workers {
            if worker.take(tick) {
                self.shared.done.fetch_add(1, SeqCst);
            }
        }
        self.wait();
    }

    fn wait(&self) {
        let mut spins = 0u32;
        while self.shared.done.load(SeqCst) < self.shared.workers.len() {
            spins += 1;
            std::hint::spin_loop();
            if spins.is_multiple_of(1024) {
                thread::yield_now();
            }
        }
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        self.shared.stop.store(true, SeqCst);
        self.shared.tick.fetch_add(1, SeqCst);
        self.wake();
        for thread in self.threads.drain(..) {
            // A panic on that thread has been reported by `finish`.
            let _ = thread.join();
        }
    }
}

/// The shares of a run and the threads that compute them.
pub(crate) struct Team {
    own: Share,
    workers: Option<Workers>,
    /// For each part, the share and the index in it; `None` if another rank computes the part. Share 0 is `own`.
    places: Vec<Option<(u32, u32)>>,
}

impl Team {
    pub fn new(graph: &Arc<Graph>, rank: usize, threads: usize) -> Self {
        let (mut shares, places) = assign(graph, rank, threads);
        let own = shares.remove(0);
        let workers = (!shares.is_empty()).then(|| Workers::new(graph, shares));
        Self { own, workers, places }
    }

    /// Number of threads, the caller's among them.
    pub fn threads(&self) -> usize {
        1 + self.workers.as_ref().map_or(0, |workers| workers.threads.len())
    }

    /// Advances all parts, and calls `meanwhile` while the others compute. The results of each part go to its range in
    /// `results`.
    ///
    /// If a node panics, all values come back first, so that the simulator can be reset and run again.
    pub fn advance<E>(
        &mut self,
        graph: &Graph,
        stage: &mut Stage,
        results: &mut [Real],
        meanwhile: impl FnOnce(&Stage) -> Result<(), E>,
    ) -> Result<(), E> {
        let Self { own, workers, .. } = self;
        let begun = workers.as_ref().map(|workers| (workers, workers.begin(stage)));
        let outcome = panic::catch_unwind(AssertUnwindSafe(|| {
            let Some((workers, tick)) = begun else {
                meanwhile(stage)?;
                own.run(graph, stage, results);
                return Ok(());
            };
            let stage = workers.shared.stage();
            let outcome = meanwhile(&stage);
            own.run(graph, &stage, results);
            workers.finish(tick, &stage);
            outcome
        }));
        if let Some((workers, tick)) = begun {
            match &outcome {
                Ok(_) => workers.collect(graph, results),
                Err(_) => workers.abandon(tick),
            }
            workers.swap(stage);
        }
        outcome.unwrap_or_else(|cause| panic::resume_unwind(cause))
    }

    /// Calls `read` with the state of a part. `None` if another rank computes the part.
    pub fn with_state<T>(&self, part: usize, read: impl FnOnce(&[Real]) -> T) -> Option<T> {
        let (share, index) = self.places[part]?;
        let of = |share: &Share| read(&share.state[share.items[index as usize].state.of()]);
        Some(match (share.checked_sub(1), &self.workers) {
            (Some(worker), Some(workers)) => {
                of(&workers.shared.workers[worker as usize].lock().share)
            }
            _ => of(&self.own),
        })
    }

    /// Replaces the state of a part, unless another rank computes the part.
    pub fn set_state(&mut self, part: usize, state: &[Real]) {
        let Some((share, index)) = self.places[part] else { return };
        let set = |share: &mut Share| {
            share.state[share.items[index as usize].state.of()].copy_from_slice(state);
        };
        match (share.checked_sub(1), &self.workers) {
            (Some(worker), Some(workers)) => {
                set(&mut workers.shared.workers[worker as usize].lock().share)
            }
            _ => set(&mut self.own),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::{
        Constant, GraphBuilder, Lowering, LoweringFault, Node, PendingLayer, Seed, Timebase,
    };

    struct NoLayers;

    impl Lowering for NoLayers {
        fn lower(
            &self,
            _layers: &[PendingLayer<'_>],
            _time: Timebase,
        ) -> Result<Vec<Box<dyn Node>>, Vec<LoweringFault>> {
            Ok(Vec::new())
        }
    }

    #[test]
    fn a_caller_that_reads_the_stage_computes_a_share_while_another_thread_waits_to_change_it() {
        let mut graph = GraphBuilder::new();
        graph.add("one", Constant::scalar(1.0));
        let graph = graph.build(Timebase::default(), &NoLayers, Seed::new(1)).expect("sound");
        let workers = Workers::new(&graph.into(), vec![Share::default()]);
        let shared = workers.shared.clone();
        let (tell, told) = mpsc::channel();
        thread::spawn(move || {
            let stage = shared.stage();
            let other = shared.clone();
            thread::spawn(move || drop(other.stage.write()));
            thread::sleep(Duration::from_millis(50));
            shared.run(0, 1, || &*stage);
            tell.send(()).expect("the test waits");
        });
        told.recv_timeout(Duration::from_secs(10)).expect("it does not block");
    }
}
