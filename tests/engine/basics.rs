//! Twenty-two basic programs of the Neural Engineering Framework, each against Nengo's on five seeds.
//!
//! Every figure is one of Nengo 4.1.0 with the same model, settings and measure, on five seeds: lowest, mean and
//! highest. The mean of ours, on five seeds too, must lie in between or nearer to the truth than the mean there. No
//! program may have more lines than that of Nengo, with one statement per line and without the lines that measure.

use std::f64::consts::TAU;

use symbolt::neurons::{AdaptiveLif, Encoders};
use symbolt::prelude::*;
use symbolt::sim::{Kind, Signal, WhiteSignal};
use symbolt::spa::{GatedMemory, Multiply};

/// The synapse of a connection for which Nengo is given none.
const S: Synapse = Synapse::lowpass_ms(5);
const SEEDS: u64 = 5;

/// One row per tick.
type Rows = Vec<Vec<f64>>;
/// Reads what a probe has recorded.
type Seen = Box<dyn Fn(&Simulator) -> Rows>;
type Program = fn(&mut GraphBuilder, Seed) -> Vec<Seen>;

fn see<K: Kind>(graph: &mut GraphBuilder, output: &Out<K>, millis: u64) -> Seen {
    let probe = graph.probe(output, ProbeSpec::default().filtered(Synapse::lowpass_ms(millis)));
    Box::new(move |sim| {
        let row = |row: &[f32]| row.iter().map(|x| f64::from(*x)).collect();
        sim.samples(&probe).iter().map(|(_, values)| row(&values)).collect()
    })
}

fn wave() -> Signal<Vector> {
    Signal::vector(1, |t, out| out[0] = (TAU * t).sin() as f32)
}

fn noise(width: usize, seed: Seed) -> WhiteSignal<Vector> {
    WhiteSignal::vector(width, SimDuration::from_secs(60), 5.0).seeded(seed)
}

fn kick() -> Signal<Vector> {
    Signal::vector(2, |t, out| out[0] = if t < 0.1 { 1.0 } else { 0.0 })
}

// The programs.

fn channel(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", wave());
    let a = g.add("a", Ensemble::new(1).identity("x"));
    let b = g.add("b", Ensemble::new(1).identity("x"));
    g.connect(&u, &a.input, S);
    g.connect(&a.output("x"), &b.input, S);
    vec![see(g, &b.output("x"), 10)]
}

fn addition(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", Constant::vector(&[0.5]));
    let v = g.add("v", Constant::vector(&[0.3]));
    let a = g.add("a", Ensemble::new(1).identity("x"));
    let b = g.add("b", Ensemble::new(1).identity("x"));
    let c = g.add("c", Ensemble::new(1).radius(1.5).identity("x"));
    g.connect(&u, &a.input, S);
    g.connect(&v, &b.input, S);
    g.route(&a.output("x") + &b.output("x") >> &c);
    vec![see(g, &c.output("x"), 10)]
}

fn square(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", wave());
    let a = g.add("a", Ensemble::new(1).decode("square", 1, |x, out| out[0] = x[0] * x[0]));
    let b = g.add("b", Ensemble::new(1).identity("x"));
    g.connect(&u, &a.input, S);
    g.connect(&a.output("square"), &b.input, S);
    vec![see(g, &b.output("x"), 10)]
}

fn multiply(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", Constant::vector(&[0.8, -0.6]));
    let corners = Encoders::choice([[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]);
    let pair = Ensemble::new(2).radius(1.5).encoders(corners);
    let c = g.add("c", pair.decode("product", 1, |x, out| out[0] = x[0] * x[1]));
    let o = g.add("o", Ensemble::new(1).identity("x"));
    g.connect(&u, &c.input, S);
    g.connect(&c.output("product"), &o.input, S);
    vec![see(g, &o.output("x"), 10)]
}

fn product(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", Constant::scalar(0.8));
    let v = g.add("v", Constant::scalar(-0.6));
    let c = g.add("c", Multiply::new());
    g.connect(&u, &c.a, S);
    g.connect(&v, &c.b, S);
    vec![see(g, &c.output, 10)]
}

fn plane(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let turn = |t: f64, out: &mut [f32]| (out[0], out[1]) = circle(t);
    let u = g.add("u", Signal::vector(2, turn));
    let a = g.add("a", Ensemble::new(2).identity("x"));
    g.connect(&u, &a.input, S);
    vec![see(g, &a.output("x"), 10)]
}

fn combine(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", Constant::vector(&[0.5]));
    let v = g.add("v", Constant::vector(&[-0.7]));
    let a = g.add("a", Ensemble::new(1).identity("x"));
    let b = g.add("b", Ensemble::new(1).identity("x"));
    let c = g.add("c", Ensemble::new(2).neurons(100).identity("x"));
    g.connect(&u, &a.input, S);
    g.connect(&v, &b.input, S);
    g.route(a.output("x").embed(0, 2) + b.output("x").embed(1, 2) >> &c);
    vec![see(g, &c.output("x"), 10)]
}

fn two_neurons(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", wave());
    let a = Ensemble::new(1).neurons(2).encoders(Encoders::given([[1.0], [-1.0]]));
    let a = g.add("a", a.intercepts(-0.5).max_rates(100.0).identity("x"));
    g.connect(&u, &a.input, S);
    vec![see(g, &a.output("x"), 100)]
}

fn integrator(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", Signal::vector(1, |t, out| out[0] = if t < 0.5 { 1.0 } else { 0.0 }));
    let a = g.add("a", Ensemble::new(1).identity("x"));
    g.route((&a.output("x") + 0.1 * &u >> &a).via(Synapse::lowpass_ms(100)));
    vec![see(g, &a.output("x"), 10)]
}

fn controlled_integrator(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", Signal::scalar(|t| if 0.2 < t && t < 0.3 { 5.0 } else { 0.0 }));
    let k = g.add("k", Signal::scalar(|t| if t < 1.0 { 1.0 } else { 0.5 }));
    let a = Ensemble::new(2).neurons(225).radius(1.5).identity("x");
    let a = g.add("a", a.decode("product", 1, |x, out| out[0] = x[0] * x[1]));
    g.route((a.output("product").embed(0, 2) >> &a).via(Synapse::lowpass_ms(100)));
    g.route(((0.1 * &u).embed(0, 2) >> &a).via(Synapse::lowpass_ms(100)));
    g.route((k.embed(1, 2) >> &a).via(S));
    vec![see(g, &a.output("x"), 10)]
}

fn oscillator(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", kick());
    let a = g.add("a", Ensemble::new(2).identity("x"));
    let turned = a.output("x").transform([[1.0, 1.0], [-1.0, 1.0]]);
    g.connect(&u, &a.input, S);
    g.route((turned >> &a).via(Synapse::lowpass_ms(100)));
    vec![see(g, &a.output("x"), 10)]
}

fn controlled_oscillator(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let turn = |x: &[f32], out: &mut [f32]| {
        let step = 0.1 * 20.0 * x[2];
        (out[0], out[1]) = (x[0] - step * x[1], x[1] + step * x[0]);
    };
    let (u, w) = (g.add("u", kick()), g.add("w", Constant::scalar(0.5)));
    let a = Ensemble::new(3).neurons(500).radius(1.7).identity("x").decode("turned", 2, turn);
    let a = g.add("a", a);
    g.route((u.embed(0, 3) + w.embed(2, 3) >> &a).via(S));
    g.route((a.output("turned").embed(0, 3) >> &a).via(Synapse::lowpass_ms(100)));
    vec![see(g, &a.output("x"), 10)]
}

fn lorenz(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let step = |x: &[f32], out: &mut [f32]| {
        out[0] = x[0] + 0.1 * 10.0 * (x[1] - x[0]);
        out[1] = x[1] + 0.1 * (-x[0] * x[2] - x[1]);
        out[2] = x[2] + 0.1 * (x[0] * x[1] - 8.0 / 3.0 * (x[2] + 28.0) - 28.0);
    };
    let a = Ensemble::new(3).neurons(LORENZ).radius(60.0).identity("x").decode("step", 3, step);
    let a = g.add("a", a);
    g.connect(&a.output("step"), &a.input, Synapse::lowpass_ms(100));
    vec![see(g, &a.output("x"), 10)]
}

fn learned_channel(g: &mut GraphBuilder, seed: Seed) -> Vec<Seen> {
    let u = g.add("u", noise(2, seed));
    let a = g.add("a", Ensemble::new(2).neurons(60).expose_neurons().identity("x"));
    let b = g.add("b", Ensemble::new(2).neurons(60).identity("x"));
    let e = g.add("e", Ensemble::new(2).neurons(60).identity("x"));
    let c = g.add("c", Learned::new(&a.neurons(), 2).rule(Pes::default()));
    g.connect(&u, &a.input, S);
    g.connect(&c.output, &b.input, S);
    g.route(&b.output("x") - &a.output("x") >> &e);
    g.connect(&e.output("x"), &c.error(), S);
    vec![see(g, &a.output("x"), 20), see(g, &b.output("x"), 20)]
}

fn learned_square(g: &mut GraphBuilder, seed: Seed) -> Vec<Seen> {
    let u = g.add("u", noise(1, seed));
    let a = Ensemble::new(1).neurons(100).expose_neurons().identity("x");
    let a = g.add("a", a.decode("square", 1, |x, out| out[0] = x[0] * x[0]));
    let b = g.add("b", Ensemble::new(1).identity("x"));
    let e = g.add("e", Ensemble::new(1).identity("x"));
    let c = g.add("c", Learned::new(&a.neurons(), 1).rule(Pes::new(2e-4)));
    g.connect(&u, &a.input, S);
    g.connect(&c.output, &b.input, S);
    g.route(&b.output("x") - &a.output("square") >> &e);
    g.connect(&e.output("x"), &c.error(), S);
    vec![see(g, &a.output("x"), 20), see(g, &b.output("x"), 20)]
}

fn array(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", Constant::vector(&EIGHT.map(|x| x as f32)));
    let a = g.add("a", Ensemble::new(1).neurons(50).copies(8).identity("x"));
    g.connect(&u, &a.input, S);
    vec![see(g, &a.output("x"), 10)]
}

fn inhibit(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", Constant::vector(&[0.8]));
    let v = g.add("v", Signal::vector(1, |t, out| out[0] = if t > 0.3 { 1.0 } else { 0.0 }));
    let a = g.add("a", Ensemble::new(1).neurons(100).expose_neurons().identity("x"));
    let c = g.add("c", Ensemble::new(1).identity("x"));
    g.connect(&u, &a.input, S);
    g.connect(&v, &c.input, S);
    g.route(c.output("x").transform([[-2.5]; 100]) >> &a.encoded());
    vec![see(g, &a.output("x"), 10)]
}

fn basal_ganglia(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", Constant::vector(&[0.8, 0.3, 0.4]));
    let a = g.add("a", BasalGanglia::new(3));
    g.connect(&u, &a.utilities, Synapse::None);
    vec![see(g, &a.chosen, 10)]
}

fn adaptation(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", Constant::vector(&[0.5]));
    let adaptive = AdaptiveLif { tau_n_s: 1.0, inc_n: 0.05, ..AdaptiveLif::default() };
    let a = g.add("a", Ensemble::new(1).model(adaptive).identity("x"));
    g.connect(&u, &a.input, S);
    vec![see(g, &a.output("x"), 10)]
}

fn delayed(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", wave());
    let a = g.add("a", Ensemble::new(1).identity("x"));
    g.connect(&u, &a.input, Synapse::alpha_ms(50));
    vec![see(g, &a.output("x"), 10)]
}

fn gated_memory(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let u = g.add("u", Signal::scalar(|t| if t < 0.5 { 0.7 } else { -0.5 }));
    let open = g.add("open", Signal::scalar(|t| if t < 0.5 { 1.0 } else { 0.0 }));
    let a = g.add("a", GatedMemory::scalar());
    g.route(&u >> &a);
    g.route(&open >> &a.open);
    vec![see(g, &a.output, 10)]
}

/// Holds the last quarter second of its input in five Legendre polynomials.
fn delay_network(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
    let odd = |i: usize| (2 * i + 1) as f32 * if i.is_multiple_of(2) { 0.4 } else { -0.4 };
    let step = |i, j| if i < j { -odd(i).abs() } else { -odd(i) * odd(j).signum() };
    let same = |i, j| if i == j { 1.0 } else { 0.0 };
    let step = [0, 1, 2, 3, 4].map(|i| [0, 1, 2, 3, 4].map(|j| step(i, j) + same(i, j)));
    let u = g.add("u", wave());
    let a = g.add("a", Ensemble::new(5).neurons(800).radius(1.4).identity("x"));
    let drive = u.transform([0, 1, 2, 3, 4].map(|i| [odd(i)]));
    g.route((drive + a.output("x").transform(step) >> &a).via(Synapse::lowpass_ms(100)));
    vec![see(g, &a.output("x"), 10)]
}

// What is measured.

const LORENZ: usize = 2_000;
/// Eight numbers from -0.9 to 0.9, evenly apart.
const EIGHT: [f64; 8] = {
    let mut all = [0.0; 8];
    let mut at = 0;
    while at < 8 {
        all[at] = -0.9 + 1.8 * at as f64 / 7.0;
        at += 1;
    }
    all
};

fn circle(t: f64) -> (f32, f32) {
    ((4.0 * t).sin() as f32, (4.0 * t).cos() as f32)
}

fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.into_iter().collect();
    values.iter().sum::<f64>() / values.len() as f64
}

/// The mean of a component over some ticks.
fn level(rows: &[Vec<f64>], component: usize) -> f64 {
    mean(rows.iter().map(|row| row[component]))
}

/// The root mean square difference of two records from a tick on.
fn rms(a: &[Vec<f64>], b: &[Vec<f64>], from: usize) -> f64 {
    assert_eq!(a.len(), b.len());
    let (a, b) = (a[from..].iter().flatten(), b[from..].iter().flatten());
    mean(a.zip(b).map(|(a, b)| (a - b).powi(2))).sqrt()
}

/// A function of the time at the end of each tick, through low-passes (ms).
fn wanted(ticks: usize, function: impl Fn(f64) -> Vec<f64>, lowpasses: &[f64]) -> Rows {
    let mut rows: Rows = (1..=ticks).map(|tick| function(tick as f64 / 1e3)).collect();
    for tau in lowpasses {
        let keep = (-1.0 / tau).exp();
        let mut state = vec![0.0; rows[0].len()];
        for row in &mut rows {
            for (state, value) in state.iter_mut().zip(row) {
                *state = keep * *state + (1.0 - keep) * *value;
                *value = *state;
            }
        }
    }
    rows
}

fn sine(t: f64) -> Vec<f64> {
    vec![(TAU * t).sin()]
}

/// The speed of a point about the origin after half a second, in rad/s.
fn speed(rows: &[Vec<f64>]) -> f64 {
    let angles: Vec<f64> = rows[500..].iter().map(|row| row[1].atan2(row[0])).collect();
    let turned =
        angles.windows(2).map(|pair| (pair[1] - pair[0] + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0);
    turned.sum::<f64>().abs() / (rows.len() - 501) as f64 * 1e3
}

fn spread(rows: &[Vec<f64>]) -> f64 {
    let middle = level(rows, 0);
    mean(rows.iter().map(|row| (row[0] - middle).powi(2))).sqrt()
}

/// A figure of a program.
struct Figure {
    name: &'static str,
    program: Program,
    ticks: u64,
    measure: fn(&[Rows]) -> f64,
    /// What a perfect network would have.
    truth: f64,
    /// Lowest, mean and highest of Nengo.
    nengo: [f64; 3],
    /// Lines of Nengo's program.
    lines: usize,
}

macro_rules! figures {
    ($($name:ident: $ticks:literal, $truth:literal, $nengo:expr, $lines:literal, $measure:expr;)+) => {
        const FIGURES: &[Figure] = &[$(Figure {
            name: stringify!($name),
            program: $name,
            ticks: $ticks,
            measure: $measure,
            truth: $truth,
            nengo: $nengo,
            lines: $lines,
        }),+];
        mod within_the_spread_of_nengo {
            $(#[test]
            fn $name() {
                super::check(stringify!($name));
            })+
        }
    };
}

// Name: ticks, truth, figures and lines of Nengo 4.1.0 (seeds 1 to 5), measure.
figures! {
    channel: 1000, 0.0, [0.0201, 0.0227, 0.0259], 9,
        |of| rms(&of[0], &wanted(1000, sine, &[5.0, 5.0, 10.0]), 100);
    addition: 500, 0.8, [0.7945, 0.8077, 0.8231], 13, |of| level(&of[0][200..], 0);
    square: 1000, 0.0, [0.0252, 0.0302, 0.0400], 9,
        |of| rms(&of[0], &wanted(1000, |t| vec![sine(t)[0].powi(2)], &[5.0, 10.0, 5.0]), 100);
    multiply: 500, -0.48, [-0.5018, -0.4942, -0.4782], 11, |of| level(&of[0][200..], 0);
    product: 500, -0.48, [-0.4873, -0.4721, -0.4521], 9, |of| level(&of[0][200..], 0);
    plane: 1000, 0.0, [0.0212, 0.0236, 0.0262], 7, |of| {
        let circle = |t| [circle(t).0, circle(t).1].map(f64::from).to_vec();
        rms(&of[0], &wanted(1000, circle, &[5.0, 10.0]), 100)
    };
    combine: 500, 0.0, [0.0048, 0.0153, 0.0295], 13,
        |of| (level(&of[0][200..], 0) - 0.5).hypot(level(&of[0][200..], 1) + 0.7);
    two_neurons: 2000, 0.0, [0.07454, 0.07458, 0.07467], 7,
        |of| rms(&of[0], &wanted(2000, sine, &[5.0, 100.0]), 1000);
    integrator: 1500, 0.5, [0.414, 0.482, 0.558], 8, |of| level(&of[0][1300..], 0);
    controlled_integrator: 1400, 0.139, [0.0876, 0.191, 0.353], 10,
        |of| level(&of[0][1390..], 0) / level(&of[0][900..1000], 0);
    oscillator: 3000, 10.0, [9.968, 9.984, 10.021], 8, |of| speed(&of[0]);
    controlled_oscillator: 3000, 10.0, [9.61, 9.94, 10.14], 14, |of| speed(&of[0]);
    lorenz: 10000, 7.9, [5.38, 7.22, 9.40], 12, |of| spread(&of[0][2000..]);
    learned_channel: 15000, 0.0, [0.0491, 0.0590, 0.0723], 14, |of| rms(&of[1], &of[0], 13000);
    learned_square: 15000, 0.0, [0.0507, 0.0585, 0.0682], 14, |of| {
        let square: Rows = of[0].iter().map(|row| vec![row[0] * row[0]]).collect();
        rms(&of[1], &square, 13000)
    };
    array: 500, 0.0, [0.0068, 0.0089, 0.0113], 8, |of| {
        let off = EIGHT.iter().enumerate().map(|(at, x)| (level(&of[0][200..], at) - x).powi(2));
        mean(off).sqrt()
    };
    inhibit: 600, 0.0, [2.8658e-8, 3.0364e-8, 3.1391e-8], 11, |of| mean(of[0][450..].iter().map(|row| row[0].abs()));
    basal_ganglia: 500, 1.0, [0.875, 0.916, 1.008], 7, |of| {
        let of = [0, 1, 2].map(|action| level(&of[0][300..], action));
        of[0] - of[1].max(of[2])
    };
    adaptation: 1500, 0.320, [0.308, 0.320, 0.334], 7, |of| level(&of[0][1200..], 0);
    delayed: 2000, 0.0, [0.0147, 0.0153, 0.0158], 7, |of| {
        // The low-passes of an alpha synapse are made discrete together.
        let (keep, mut a, mut b) = ((-1.0f64 / 50.0).exp(), 0.0, 0.0);
        let alpha = |row: Vec<f64>| {
            b = keep * b + (1.0 - keep) * a + (1.0 - keep - keep / 50.0) * (row[0] - a);
            a = keep * a + (1.0 - keep) * row[0];
            vec![b]
        };
        let slow: Rows = wanted(2000, sine, &[]).into_iter().map(alpha).collect();
        let slow = wanted(2000, |t| slow[(t * 1e3).round() as usize - 1].clone(), &[10.0]);
        rms(&of[0], &slow, 1000)
    };
    delay_network: 3000, 0.0, [0.045, 0.050, 0.055], 13, |of| {
        let late = |at: usize| sine(at as f64 / 1e3 - 0.26)[0];
        let off = |at: usize| (of[0][at - 1].iter().sum::<f64>() - late(at)).powi(2);
        mean((1001..=3000).map(off)).sqrt()
    };
    gated_memory: 1500, 0.7, [0.610, 0.708, 0.770], 9, |of| level(&of[0][1300..], 0);
}

/// Returns the figure of a program on each seed.
fn measured(figure: &Figure) -> Vec<f64> {
    let plan = PopulationPlan::lif();
    let one = |seed| {
        let mut graph = GraphBuilder::new();
        let seen = (figure.program)(&mut graph, Seed::new(seed));
        let sim = graph.run(&plan, Seed::new(seed), SimDuration::from_millis(figure.ticks));
        let sim = sim.unwrap_or_else(|error| panic!("{}: {error}", figure.name));
        let seen: Vec<Rows> = seen.iter().map(|seen| seen(&sim)).collect();
        assert!(seen.iter().all(|rows| rows.len() == figure.ticks as usize));
        (figure.measure)(&seen)
    };
    (1..=SEEDS).map(one).collect()
}

/// Returns whether a mean is within the spread of Nengo, or better.
fn as_good(found: f64, Figure { truth, nengo: [low, mean, high], .. }: &Figure) -> bool {
    (*low..=*high).contains(&found) || (found - truth).abs() <= (mean - truth).abs()
}

fn figure(name: &str) -> &'static Figure {
    FIGURES.iter().find(|figure| figure.name == name).expect("a program")
}

fn check(name: &str) {
    let figure = figure(name);
    let all = measured(figure);
    let found = mean(all.iter().copied());
    println!("{name} {found:.5} {all:.5?} Nengo {:?}", figure.nengo);
    assert!(as_good(found, figure), "{name}: {found} of {all:?}; Nengo {:?}", figure.nengo);
}

#[test]
fn a_worse_program_is_caught() {
    /// The channel with half the neurons.
    fn fewer(g: &mut GraphBuilder, _: Seed) -> Vec<Seen> {
        let u = g.add("u", wave());
        let a = g.add("a", Ensemble::new(1).neurons(50).identity("x"));
        let b = g.add("b", Ensemble::new(1).neurons(50).identity("x"));
        g.connect(&u, &a.input, S);
        g.connect(&a.output("x"), &b.input, S);
        vec![see(g, &b.output("x"), 10)]
    }
    let channel = figure("channel");
    let worse = measured(&Figure { program: fewer, ..*channel });
    assert!(!as_good(mean(worse.iter().copied()), channel), "{worse:?}");
}

#[test]
fn no_program_is_longer_than_that_of_nengo() {
    let source = include_str!("basics.rs");
    let lines = |name: &str| {
        let (_, program) = source.split_once(&format!("\nfn {name}(")).expect("a program");
        program.split("\n}\n").next().expect("a part").lines().count()
    };
    for Figure { name, lines: most, .. } in FIGURES {
        assert!(lines(name) <= *most, "{name}: {} lines; expected at most {most}", lines(name));
    }
    assert_eq!(FIGURES.len(), 22);
}
