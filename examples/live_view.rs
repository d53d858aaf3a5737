//! A model that chooses what to take, live in a browser: what happens if its memory is silenced?
//!
//! `cargo run --release --features view --example live_view`, or with `-- bench` behind it: what a window costs; with the name of a
//! network of `symbolt bench`, such as `-- large`: that one live.

use std::error::Error;
use std::net::TcpStream;
use std::ops::ControlFlow;
use std::process::Command;
use std::time::Instant;

use symbolt::prelude::*;
use symbolt::sim::{Live, LiveOptions};
use symbolt::study::standard::{Model, Standard};
use symbolt::view::View;
use tungstenite::Message;
use tungstenite::client::{IntoClientRequest, client};

symbolt::vocabulary!(Parts = "parts": NUT, BOLT);

/// What the model chooses among.
pub const CHOICES: [&str; 3] = ["TAKE_NUT", "TAKE_BOLT", "WAIT"];

/// A request for the NUT is shown for 100 ms; a memory keeps it. From 150 ms on a BOLT is seen, too. Of the rules that look at both, the
/// strongest acts.
pub fn model(plan: &PopulationPlan, dim: usize) -> Result<Simulator, Box<dyn Error>> {
    let parts = Parts::vocabulary(dim, Seed::new(1))?;
    let mut graph = GraphBuilder::new();
    let request = graph.add("request", parts.stimulus([(0, "NUT"), (100, "0")])?);
    let vision = graph.add("vision", parts.stimulus([(0, "0"), (150, "0.5 * BOLT")])?);
    let memory = graph.add("memory", State::new(&parts).recurrent(Synapse::lowpass_ms(100)));
    graph.route(&request >> &memory);
    let rules = Rules::new()
        .rule(CHOICES[0], memory.dot(Parts::NUT), [])
        .rule(CHOICES[1], vision.dot(Parts::BOLT), [])
        .otherwise(CHOICES[2], 0.3, []);
    graph.add("rules", rules);
    Ok(graph.start(plan, Seed::new(1))?)
}

/// Opens a window without a browser, which lets the run go as fast as it goes, with two plots. It reads frames as they come, or after
/// the first none. Returns the connection, which closes when it is dropped.
fn watch(address: &str, reads: bool) -> Result<TcpStream, Box<dyn Error>> {
    let (host, token) = address.split_once("/#").ok_or("no token")?;
    let port = host.rsplit_once(':').ok_or("no port")?.1.parse::<u16>()?;
    let mut request = format!("ws://127.0.0.1:{port}/live").into_client_request()?;
    request.headers_mut().insert("Origin", host.parse()?);
    let stream = TcpStream::connect(("127.0.0.1", port))?;
    let kept = stream.try_clone()?;
    let (mut socket, _) = client(request, stream)?;
    let similar =
        r#"{"plot":{"key":1,"what":{"similar":{"output":"memory.output","to":["NUT","BOLT"]}}}}"#;
    let values = r#"{"plot":{"key":2,"what":{"values":{"output":"memory.output","count":64}}}}"#;
    let token = format!("{{\"token\":\"{token}\"}}");
    for text in [&*token, similar, values, r#"{"run":{}}"#] {
        socket.send(Message::text(text))?;
    }
    let plotted = |message: Message| message.to_text().is_ok_and(|text| text.contains("plotted"));
    for _ in 0..2 {
        while !plotted(socket.read()?) {}
    }
    if reads {
        std::thread::spawn(move || while socket.read().is_ok() {});
    }
    Ok(kept)
}

/// What a stretch of the run took: wall time and processor time of its thread, in seconds.
fn timed(run: impl FnOnce() -> Result<(), Box<dyn Error>>) -> Result<[f64; 2], Box<dyn Error>> {
    // Nanoseconds on a processor, as Linux counts them.
    let processor_s = || -> Result<f64, Box<dyn Error>> {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat")?;
        Ok(1e-9 * text.split(' ').next().ok_or("no time")?.parse::<f64>()?)
    };
    let (began, before_s) = (Instant::now(), processor_s()?);
    run()?;
    Ok([began.elapsed().as_secs_f64(), processor_s()? - before_s])
}

/// Number of runs of each kind that `bench` measures.
const ROUNDS: usize = 16;
/// The kinds of runs: alone, with a window that reads, and with one that does not.
const KINDS: [&str; 3] = ["alone", "reads", "silent"];

/// Runs a large spiking model alone, with a window that reads, and with one that does not, in turn. Prints what windows cost: wall
/// time, processor time of the run's thread, and what of that comes on a second. Frames come by the clock, so the last is what a
/// window costs on a processor that the run has for itself, whatever else runs here.
///
/// Each run has a process of its own: where memory lies makes a difference of some percent, which stays as long as a process does.
fn bench() -> Result<(), Box<dyn Error>> {
    let own = std::env::current_exe()?;
    const MEASURES: [&str; 3] = ["wall time", "processor time", "processor time in a second"];
    let mut more: [[Vec<f64>; 3]; 2] = Default::default();
    for _ in 0..ROUNDS {
        let mut took = [[0.0; 2]; 3];
        for (kind, took) in KINDS.iter().zip(&mut took) {
            let ran = Command::new(&own).args(["bench", kind]).output()?;
            let text = String::from_utf8(ran.stdout)?;
            let numbers: Vec<f64> =
                text.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
            *took = numbers.try_into().map_err(|_| "a run of the bench failed")?;
        }
        let [alone, watched @ ..] = took;
        for (more, [wall_s, processor_s]) in more.iter_mut().zip(watched) {
            let parts = [
                wall_s / alone[0] - 1.0,
                processor_s / alone[1] - 1.0,
                (processor_s - alone[1]) / wall_s,
            ];
            more.iter_mut().zip(parts).for_each(|(more, part)| more.push(100.0 * part));
        }
    }
    for (more, window) in more.iter_mut().zip(["that reads", "that does not"]) {
        for (more, measure) in more.iter_mut().zip(MEASURES) {
            more.sort_by(f64::total_cmp);
            let mean = more.iter().sum::<f64>() / more.len() as f64;
            let spread = more.iter().map(|one| (one - mean).powi(2)).sum::<f64>();
            let error = (spread / (more.len() * (more.len() - 1)) as f64).sqrt();
            let median = more[more.len() / 2];
            println!(
                "a window {window}: {measure} {mean:+.2}% (standard error {error:.2}, median {median:+.2}%)"
            );
        }
    }
    Ok(())
}

/// Measures one run of a kind, after another one that has ended, and prints what it took.
fn measure(kind: &str) -> Result<(), Box<dyn Error>> {
    let ticks = 40_000;
    let graph = model(&PopulationPlan::lif(), 256)?.graph().clone();
    let start = || -> Result<Live, Box<dyn Error>> {
        let sim = Simulator::new(graph.clone(), RunConfig::seeded(Seed::new(1)))?;
        Ok(Live::new(sim, LiveOptions::default())?)
    };
    let [wall_s, processor_s] = if kind == KINDS[0] {
        start()?.step(ticks / 10)?;
        let mut live = start()?;
        timed(|| Ok(live.step(ticks).map(|_| ())?))?
    } else {
        let reads = kind == KINDS[1];
        let mut view = View::bind()?;
        let address = view.address().to_owned();
        let window = std::thread::spawn(move || watch(&address, reads).map_err(|e| e.to_string()));
        // The window is opened before the time counts, and one that does not read is full.
        let mut live = start()?;
        let (began, warm_s) = (Instant::now(), if reads { 0.1 } else { 8.0 });
        view.drive(&mut live, |_| match began.elapsed().as_secs_f64() >= warm_s {
            true => ControlFlow::Break(StopReason::TimeUp),
            false => ControlFlow::Continue(()),
        })?;
        drop(live);
        let _open = window.join().map_err(|_| "no window")??;
        let mut live = start()?;
        timed(|| {
            view.drive(&mut live, |view| match view.tick() >= ticks {
                true => ControlFlow::Break(StopReason::TimeUp),
                false => ControlFlow::Continue(()),
            })?;
            Ok(())
        })?
    };
    println!("{wall_s} {processor_s}");
    Ok(())
}

#[allow(dead_code)] // The tests call `model`.
fn main() -> Result<(), Box<dyn Error>> {
    let sim = match std::env::args().nth(1).as_deref() {
        Some("bench") => return std::env::args().nth(2).map_or_else(bench, |kind| measure(&kind)),
        Some(name) => {
            let built = Standard::default().build(name.parse::<Model>()?)?;
            Simulator::new(built.graph().clone(), RunConfig::seeded(Seed::new(1)))?
        }
        None => model(&PopulationPlan::lif(), 64)?,
    };
    let mut view = View::bind()?.titled("what to take");
    println!("Open {}", view.address());
    let live = view.serve(Live::new(sim, LiveOptions::default())?)?;
    print!("{}", live.log());
    Ok(())
}
