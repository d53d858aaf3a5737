//! A model that chooses what to take, live in a browser: what happens if its memory is silenced?
//!
//! `cargo run --release --features view --example live_view`, or with `-- bench` behind it: what a window costs; with
//! `-- stalled`: one that reads no frames.

use std::error::Error;
use std::net::TcpStream;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use symbolt::prelude::*;
use symbolt::sim::{Live, LiveOptions};
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

/// Opens a window without a browser, which lets the run go as fast as it goes, with two plots. It reads frames as they come, or after the first none.
fn watch(address: &str, reads: bool) -> Result<(), Box<dyn Error>> {
    let (host, token) = address.split_once("/#").ok_or("no token")?;
    let port = host.rsplit_once(':').ok_or("no port")?.1.parse::<u16>()?;
    let mut request = format!("ws://127.0.0.1:{port}/live").into_client_request()?;
    request.headers_mut().insert("Origin", host.parse()?);
    let (mut socket, _) = client(request, TcpStream::connect(("127.0.0.1", port))?)?;
    let similar =
        r#"{"plot":{"key":1,"what":{"similar":{"output":"memory.output","to":["NUT","BOLT"]}}}}"#;
    let values = r#"{"plot":{"key":2,"what":{"values":{"output":"memory.output","count":64}}}}"#;
    let token = format!("{{\"token\":\"{token}\"}}");
    for text in [&*token, similar, values, r#"{"run":{}}"#] {
        socket.send(Message::text(text))?;
    }
    std::thread::spawn(move || {
        while socket.read().is_ok() {
            if !reads {
                // It keeps the connection for longer than the bench lasts.
                std::thread::sleep(Duration::from_secs(3_600));
            }
        }
    });
    Ok(())
}

/// Runs a large spiking model with and without a window, in turn, and prints the wall times.
fn bench(reads: bool) -> Result<(), Box<dyn Error>> {
    let plan = PopulationPlan::all(Population::Lif(LifSpec::default()));
    let ticks = 2_000;
    let graph = model(&plan, 256)?.graph().clone();
    let start = || -> Result<Live, Box<dyn Error>> {
        let sim = Simulator::new(graph.clone(), RunConfig::seeded(Seed::new(1)))?;
        Ok(Live::new(sim, LiveOptions::default())?)
    };
    let mut view = View::bind()?;
    watch(view.address(), reads)?;
    let more = |[alone, watched]: [Duration; 2]| {
        100.0 * (watched.as_secs_f64() / alone.as_secs_f64() - 1.0)
    };
    let mut sum = [Duration::ZERO; 2];
    let mut pairs = Vec::new();
    for pair in 0..12 {
        let mut live = start()?;
        let began = Instant::now();
        live.step(ticks)?;
        let alone = began.elapsed();
        let mut live = start()?;
        let began = Instant::now();
        view.drive(&mut live, |view| match view.tick() >= ticks {
            true => ControlFlow::Break(StopReason::TimeUp),
            false => ControlFlow::Continue(()),
        })?;
        let both = [alone, began.elapsed()];
        // In the first pair the window is opened.
        if pair > 0 {
            println!("{:.3?} alone, {:.3?} watched: {:+.1}%", both[0], both[1], more(both));
            pairs.push(more(both));
            sum = [sum[0] + both[0], sum[1] + both[1]];
        }
    }
    pairs.sort_by(f64::total_cmp);
    println!("{:+.1}% in all, {:+.1}% in the median", more(sum), pairs[pairs.len() / 2]);
    Ok(())
}

#[allow(dead_code)] // The tests call `model`.
fn main() -> Result<(), Box<dyn Error>> {
    match std::env::args().nth(1).as_deref() {
        Some("bench") => return bench(true),
        Some("stalled") => return bench(false),
        _ => {}
    }
    let sim = model(&PopulationPlan::all(Population::Lif(LifSpec::default())), 64)?;
    let mut view = View::bind()?.titled("what to take");
    println!("Open {}", view.address());
    let live = view.serve(Live::new(sim, LiveOptions::default())?)?;
    print!("{}", live.log());
    Ok(())
}
