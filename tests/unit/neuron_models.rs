//! Compares neuron models with what Nengo computes (`tests/conformance/fixtures.py`), and with closed forms.

use std::path::Path;

use ndarray::{Array2, Ix1, Ix2};

use super::models::{series::exp, *};
use crate::files::npz::NpzReader;
use crate::sim::Real;

const DT_S: Real = 0.001;

/// A model under the name that the fixture gives it, and the start of its state.
type Named = (&'static str, Box<dyn NeuronModel>, Vec<Real>);

fn named(name: &'static str, model: impl NeuronModel, start: &[Real]) -> Named {
    (name, Box::new(model), start.to_vec())
}

fn izhikevich() -> [(&'static str, Izhikevich); 6] {
    [
        ("izhikevich_rs", Izhikevich::regular_spiking()),
        ("izhikevich_ib", Izhikevich::bursting()),
        ("izhikevich_ch", Izhikevich::chattering()),
        ("izhikevich_fs", Izhikevich::fast_spiking()),
        ("izhikevich_lts", Izhikevich::low_threshold()),
        ("izhikevich_rz", Izhikevich::resonator()),
    ]
}

fn all() -> Vec<Named> {
    let adaptive = AdaptiveLif { tau_n_s: 0.2, ..AdaptiveLif::default() };
    let mut all = vec![
        named("lif", Lif::default(), &[0.0, 0.0]),
        named("adaptive_lif", AdaptiveLif::default(), &[0.0, 0.0, 0.0]),
        named("adaptive_lif_rate", AdaptiveLifRate(adaptive), &[0.0]),
        named("rectified_linear", RectifiedLinear, &[]),
        named("spiking_rectified_linear", SpikingRectifiedLinear, &[0.3, 0.0]),
        named("sigmoid", Sigmoid::default(), &[]),
        named("tanh", Tanh::default(), &[]),
        named("regular_tanh", RegularSpiking::new(Tanh::default()), &[0.3, 0.0]),
        named("regular_lif", RegularSpiking::new(LifRate::default()), &[0.3, 0.0]),
    ];
    all.extend(izhikevich().map(|(name, model)| named(name, model, &[-65.0, -13.0, 0.0])));
    all
}

fn bytes() -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/conformance");
    std::fs::read(folder.join("models.npz")).expect("a fixture")
}

fn matrix(npz: &mut NpzReader<'_>, name: String) -> Array2<f64> {
    npz.read::<f64, Ix2>(&name).expect("a matrix of doubles")
}

fn vector(npz: &mut NpzReader<'_>, name: &str) -> Vec<f64> {
    npz.read::<f64, Ix1>(name).expect("a vector of doubles").to_vec()
}

/// Steps neurons at constant currents; `start` holds the start of each variable. Returns a row of activities per tick.
/// Blocks have so many neurons.
fn run(
    model: &dyn NeuronModel,
    currents: &[Real],
    start: &[Real],
    (ticks, block): (u64, usize),
) -> Array2<f64> {
    let count = currents.len();
    let mut out = Array2::zeros((ticks as usize, count));
    for from in (0..count).step_by(block) {
        let own = &currents[from..(from + block).min(count)];
        let mut state: Vec<Real> = start.iter().flat_map(|value| vec![*value; own.len()]).collect();
        let mut activity = vec![0.0; own.len()];
        for tick in 0..ticks {
            let draws = Draws::new(crate::sim::mix64(tick), from);
            let (state, activity) = (&mut *state, &mut *activity);
            model.step(Block { dt_s: DT_S, currents: own, state, activity, draws });
            for (i, activity) in activity.iter().enumerate() {
                out[(tick as usize, from + i)] = f64::from(*activity);
            }
        }
    }
    out
}

#[test]
fn rates_gains_and_biases_are_nengos() {
    let bytes = bytes();
    let mut npz = NpzReader::new(&bytes).expect("arrays");
    let currents = vector(&mut npz, "currents");
    let (rates, intercepts) = (vector(&mut npz, "max_rates"), vector(&mut npz, "intercepts"));
    let mut compared = 0;
    for (name, model, _) in all() {
        model.check(0.001).expect("sound");
        let mut ours = currents.clone();
        model.rates(&mut ours);
        let theirs = vector(&mut npz, &format!("{name}_rates"));
        for (ours, theirs) in ours.iter().zip(&theirs) {
            assert!(
                (ours - theirs).abs() <= 1e-6 * theirs.abs().max(1.0),
                "{name}: {ours} {theirs}"
            );
            compared += 1;
        }
        // In single precision the solver needs five digits.
        let mut single: Vec<f32> = currents.iter().map(|x| *x as f32).collect();
        model.rates_single(&mut single);
        for (ours, theirs) in single.iter().zip(&theirs) {
            let off = (f64::from(*ours) - theirs).abs();
            // The count of spikes may change by one with the last digit of a current.
            let counted = name.starts_with("izhikevich") && off <= 1.0;
            assert!(counted || off <= 2e-5 * theirs.abs().max(1e-3), "{name}: {ours} {theirs}");
        }
        let built = matrix(&mut npz, format!("{name}_gain_bias"));
        for (i, (rate, intercept)) in rates.iter().zip(&intercepts).enumerate() {
            let (gain, bias) = model.gain_bias(*rate, *intercept).expect("possible");
            if name.starts_with("izhikevich") {
                // Nengo interpolates a table; we search for the least current that reaches the rate, which the steps of
                // a rate may pass by far.
                let most = gain + bias;
                let mut ours = [most, most - 1e-3 * most, gain * intercept + bias - 1e-5];
                model.rates(&mut ours);
                assert!(ours[0] >= *rate && ours[1] < *rate && ours[2] == 0.0, "{name}: {ours:?}");
                continue;
            }
            assert!((gain - built[(0, i)]).abs() <= 1e-9 * gain.abs(), "{name}: {gain}");
            assert!((bias - built[(1, i)]).abs() <= 1e-9 * gain.abs().max(1.0), "{name}: {bias}");
            compared += 2;
        }
    }
    assert_eq!(compared, 15 * 13 + 9 * 8);
}

#[test]
fn in_the_step_of_the_hot_loop_spikes_fall_in_the_ticks_of_nengo() {
    let bytes = bytes();
    let mut npz = NpzReader::new(&bytes).expect("arrays");
    let currents: Vec<Real> = vector(&mut npz, "currents").iter().map(|x| *x as Real).collect();
    let (mut spikes, mut moved) = (0.0, 0);
    for (name, model, start) in all() {
        let ours = run(&*model, &currents, &start, (1_000, 5));
        if model.firing() == Firing::Rates {
            let theirs = matrix(&mut npz, format!("{name}_activities"));
            assert_eq!(theirs.nrows(), 4);
            for ((row, neuron), rate) in theirs.indexed_iter() {
                let off = (ours[(99 + 300 * row, neuron)] - rate).abs();
                assert!(off <= 2e-5 * rate.abs().max(1e-3), "{name}: {neuron}, {off} of {rate}");
            }
            continue;
        }
        let theirs = matrix(&mut npz, format!("{name}_spikes"));
        assert_eq!(theirs.dim(), ours.dim(), "{name}");
        spikes += theirs.iter().map(|x| x.abs()).sum::<f64>();
        if name.starts_with("izhikevich") {
            // Rounding grows from spike to spike here, so single precision agrees at the beginning: see the next test.
            let first = |all: &Array2<f64>, neuron: usize| -> Vec<usize> {
                (0..1_000).filter(|tick| all[(*tick, neuron)] != 0.0).take(3).collect()
            };
            for neuron in 0..13 {
                let (ours, theirs) = (first(&ours, neuron), first(&theirs, neuron));
                let near = ours.iter().zip(&theirs).all(|(a, b)| a.abs_diff(*b) <= 2);
                assert!(ours.len() == theirs.len() && near, "{name}: {ours:?} {theirs:?}");
            }
            continue;
        }
        moved += ours.iter().zip(&theirs).filter(|(a, b)| a != b).count();
    }
    assert!(spikes > 10_000.0);
    // A spike that falls one tick later differs in two ticks. Nothing else differs.
    println!("{moved} ticks differ");
    assert!(moved <= 8, "{moved}");
}

#[test]
fn in_double_precision_every_spike_of_adaptive_and_izhikevich_neurons_is_nengos() {
    let bytes = bytes();
    let mut npz = NpzReader::new(&bytes).expect("arrays");
    let currents = vector(&mut npz, "currents");
    let mut spikes = 0;
    let mut same = |name: &str, neuron: usize, step: &mut dyn FnMut() -> bool| {
        let theirs = matrix(&mut npz, format!("{name}_spikes"));
        for tick in 0..1_000 {
            let fires = step();
            assert_eq!(fires, theirs[(tick, neuron)] != 0.0, "{name}: {neuron}, tick {tick}");
            spikes += usize::from(fires);
        }
    };
    for (neuron, current) in currents.iter().enumerate() {
        let (mut v, mut r, mut n) = (0.0, 0.0, 0.0);
        let model = AdaptiveLif::default();
        let mut step = || model.step_exactly(0.001, *current, (&mut v, &mut r), &mut n);
        same("adaptive_lif", neuron, &mut step);
        for (name, model) in izhikevich() {
            let (mut v, mut u) = (-65.0, -13.0);
            same(name, neuron, &mut || model.step_exactly(0.001, *current, &mut v, &mut u));
        }
    }
    assert!(spikes > 4_000, "{spikes}");
}

/// Spikes of 64 neurons at currents that change, in 4,000 ticks: by the hot loop, and in double precision.
fn spikes_at(dt_s: f64, stepped: Lif, exact: Lif) -> (Vec<u32>, Vec<u32>) {
    const N: usize = 64;
    let (mut state, mut activity) = (vec![0.0 as Real; 2 * N], vec![0.0 as Real; N]);
    let mut exactly = [(0.0, 0.0); N];
    let (mut ours, mut right) = (vec![0; N], vec![0; N]);
    for tick in 0..4_000 {
        let phase = f64::from(tick) * 0.013;
        let current = |n: usize| (0.6 + 0.4 * n as f64) * (1.0 + 0.5 * (phase + n as f64).sin());
        let currents: Vec<Real> = (0..N).map(|n| current(n) as Real).collect();
        let (dt_s, draws) = (dt_s as Real, Draws::default());
        let (state, activity) = (&mut state, &mut activity);
        stepped.step(Block { dt_s, currents: &currents, state, activity, draws });
        for (n, (v, r)) in exactly.iter_mut().enumerate() {
            ours[n] += u32::from(activity[n] != 0.0);
            let fires = exact.step_exactly(f64::from(dt_s), f64::from(currents[n]), v, r);
            right[n] += u32::from(fires);
        }
    }
    (ours, right)
}

#[test]
fn ticks_of_every_length_have_the_spikes_of_double_precision() {
    let off = |(ours, right): (Vec<u32>, Vec<u32>)| -> u32 {
        assert!(right.iter().sum::<u32>() > 3_000, "{right:?}");
        ours.iter().zip(&right).map(|(a, b)| a.abs_diff(*b)).sum()
    };
    // Ticks of 1/200 to 1/4 of the time constant, on both sides of 1/16.
    for (dt_s, tau_rc_s) in [
        (1e-4, 0.02),
        (1e-3, 0.02),
        (1e-3, 0.016),
        (1.25e-3, 0.02),
        (1.3e-3, 0.02),
        (2e-3, 0.02),
        (5e-3, 0.02),
        (1e-3, 0.005),
        (1e-5, 5e-5),
        (0.1, 0.5),
    ] {
        let lif = Lif { tau_rc_s, tau_ref_s: 0.1 * tau_rc_s, ..Lif::default() };
        let found = off(spikes_at(dt_s, lif, lif));
        println!("{dt_s} {tau_rc_s}: {found}");
        assert!(found <= 8, "{dt_s} of {tau_rc_s}: {found}");
        // The wrong variant: a time constant that is longer by one percent.
        let wrong = Lif { tau_rc_s: 1.01 * tau_rc_s, ..lif };
        assert!(off(spikes_at(dt_s, lif, wrong)) > 8, "{dt_s} of {tau_rc_s}");
    }
}

#[test]
fn the_search_for_gain_and_bias_finds_the_closed_form() {
    /// A model that gives only its rates.
    #[derive(Debug)]
    struct Searched(Lif);
    impl NeuronModel for Searched {
        fn name(&self) -> &'static str {
            "searched"
        }
        fn check(&self, _dt_s: f64) -> Result<(), crate::neurons::TuningError> {
            Ok(())
        }
        fn rates(&self, currents: &mut [f64]) {
            self.0.rates(currents);
        }
        fn firing(&self) -> Firing {
            Firing::Rates
        }
        fn state(&self) -> Vec<Variable> {
            Vec::new()
        }
        fn step(&self, _block: Block<'_>) {}
        fn fingerprint(&self, _hash: &mut crate::sim::Fingerprint) {}
    }
    let (lif, searched) = (Lif::default(), Searched(Lif::default()));
    assert!((searched.onset() - 1.0).abs() < 1e-9, "{}", searched.onset());
    for (rate, intercept) in [(200.0, -1.0), (400.0, 0.9), (317.0, 0.0), (480.0, -0.3)] {
        let closed = lif.gain_bias(rate, intercept).expect("possible");
        let found = searched.gain_bias(rate, intercept).expect("possible");
        assert!((closed.0 - found.0).abs() < 1e-6 * closed.0, "{closed:?} {found:?}");
        assert!((closed.1 - found.1).abs() < 1e-6 * closed.0, "{closed:?} {found:?}");
    }
    for rate in [500.0, 0.0, -1.0, f64::NAN] {
        let error = searched.gain_bias(rate, 0.0).expect_err("impossible").to_string();
        assert!(error.contains("`max_rate`"), "{error}");
    }
}

#[test]
fn a_model_that_is_never_silent_needs_an_onset_of_its_own() {
    let all: [(Box<dyn NeuronModel>, f64); 2] =
        [(Box::new(Sigmoid::default()), 400.0), (Box::new(Tanh::default()), 400.0)];
    for (model, limit) in all {
        for rate in [limit, limit + 1.0, 0.0, f64::NAN] {
            let error = model.gain_bias(rate, 0.0).expect_err("impossible").to_string();
            assert!(error.contains("400 Hz"), "{error}");
        }
        let error = model.gain_bias(300.0, 1.0).expect_err("impossible").to_string();
        assert!(error.contains("`intercept` is 1"), "{error}");
    }
}

#[test]
fn bad_parameters_are_refused_by_name() {
    let adaptive = AdaptiveLif::default();
    let rs = Izhikevich::default();
    let bad: [(Box<dyn NeuronModel>, &str); 10] = [
        (Box::new(AdaptiveLif { tau_n_s: 0.0, ..adaptive }), "tau_n_s"),
        (Box::new(AdaptiveLif { inc_n: -1.0, ..adaptive }), "inc_n"),
        (Box::new(AdaptiveLifRate(AdaptiveLif { inc_n: f64::NAN, ..adaptive })), "inc_n"),
        (Box::new(AdaptiveLif { tau_n_s: 1e-4, ..adaptive }), "tick"),
        (Box::new(Sigmoid { tau_ref_s: 0.0 }), "tau_ref_s"),
        (Box::new(Tanh { tau_ref_s: f64::INFINITY }), "tau_ref_s"),
        (Box::new(Izhikevich { recovery_rate: 0.0, ..rs }), "recovery_rate"),
        (Box::new(Izhikevich { coupling: f64::NAN, ..rs }), "coupling"),
        (Box::new(Izhikevich { reset_voltage: 30.0, ..rs }), "reset_voltage"),
        (Box::new(PoissonSpiking::new(Sigmoid { tau_ref_s: -1.0 })), "tau_ref_s"),
    ];
    for (model, setting) in bad {
        let error = model.check(0.001).expect_err(setting).to_string();
        assert!(error.contains(&format!("`{setting}`")), "{error}");
    }
}

#[test]
fn exponentials_are_exact_to_single_precision() {
    for step in -8_700..=8_700i16 {
        let x = f32::from(step) / 100.0;
        let exact = f64::from(x).exp();
        assert!((f64::from(exp(x)) / exact - 1.0).abs() < 3e-7, "{x}");
    }
    assert!(exp(f32::MAX).is_finite() && exp(f32::MIN) < 1e-37);
}

/// Mean and variance of the activity in a tick, over ticks and neurons, at the rate of a rectified linear base.
fn moments(model: impl NeuronModel, rate: Real) -> (f64, f64) {
    let out = run(&model, &[rate; 100], &vec![0.0; model.state().len()], (2_000, 128));
    let mean = out.mean().expect("ticks");
    (mean, out.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / out.len() as f64)
}

#[test]
fn stochastic_and_poisson_spikes_have_their_mean_and_variance() {
    // 200,000 draws: the standard error of the mean is the root of variance / 200,000.
    for rate in [3.0, 100.0, 430.0, 1_000.0, 2_500.0, 9_000.0, 60_000.0] {
        let due = f64::from(rate) * 1e-3;
        let fraction = due - due.floor();
        let poisson = (PoissonSpiking::new(RectifiedLinear), due);
        let (mean, variance) = moments(poisson.0, rate);
        let error = (due / 2e5).sqrt();
        assert!((mean - due).abs() < 4.5 * error, "poisson: {mean} of {due}");
        assert!((variance / due - 1.0).abs() < 0.02 + 5.0 * error, "poisson: {variance} of {due}");
        let (mean, variance) = moments(StochasticSpiking::new(RectifiedLinear), rate);
        let wanted = fraction * (1.0 - fraction);
        let error = (wanted / 2e5).sqrt();
        assert!((mean - due).abs() < 4.5 * error + 1e-6 * due, "stochastic: {mean} of {due}");
        assert!((variance - wanted).abs() < 0.02 * wanted + 1e-3, "{variance} of {wanted}");
    }
    // Negative rates give negative spikes.
    let (mean, _) = moments(StochasticSpiking::new(Tanh::default()), -0.5);
    assert!((mean + 0.184_847).abs() < 0.004, "{mean}");
    let (mean, _) = moments(PoissonSpiking::new(Tanh::default()), -0.5);
    assert!((mean + 0.184_847).abs() < 0.004, "{mean}");
}

#[test]
fn random_spikes_do_not_depend_on_how_blocks_are_cut_nor_repeat_between_neurons_and_ticks() {
    let model = PoissonSpiking::new(RectifiedLinear);
    let currents: Vec<Real> = (0..96).map(|i| 20.0 * (i as Real + 1.0)).collect();
    let whole = run(&model, &currents, &[0.0], (200, 96));
    for block in [1, 7, 32] {
        assert!(run(&model, &currents, &[0.0], (200, block)) == whole, "{block}");
    }
    // Correlation between neighbours and between ticks, of equal rates: within 5 standard errors of 0.
    let out = run(&model, &[300.0; 64], &[0.0], (2_000, 64));
    let centred = &out - out.mean().expect("ticks");
    let variance = centred.mapv(|x| x * x).mean().expect("ticks");
    let lagged = |rows: usize, columns: usize| {
        let (n, m) = centred.dim();
        let a = centred.slice(ndarray::s![rows.., columns..]);
        let b = centred.slice(ndarray::s![..n - rows, ..m - columns]);
        (&a * &b).mean().expect("ticks") / variance
    };
    for (rows, columns) in [(0, 1), (1, 0), (1, 1), (0, 8), (7, 3)] {
        let r = lagged(rows, columns);
        assert!(r.abs() < 5.0 / 128_000f64.sqrt(), "{rows}, {columns}: {r}");
    }
}

#[test]
fn regular_spikes_are_counted_exactly() {
    // Voelker et al. 2020: floor(v0 + N r dt) spikes after N ticks.
    let ticks = run(&RegularSpiking::new(RectifiedLinear), &[333.0], &[0.0, 0.0], (20, 1));
    let fired: Vec<usize> = (0..20).filter(|t| ticks[(*t, 0)] > 0.0).map(|t| t + 1).collect();
    assert_eq!(fired, [4, 7, 10, 13, 16, 19]);
    let counts = run(&SpikingRectifiedLinear, &[2_500.0], &[0.5, 0.0], (5, 1));
    assert_eq!(counts.iter().copied().collect::<Vec<_>>(), [3.0, 2.0, 3.0, 2.0, 3.0]);
}

#[test]
fn adaptation_ends_at_the_closed_form() {
    // r = f(J - inc_n r), by the adaptation after 20 time constants.
    let model = AdaptiveLif { tau_n_s: 0.25, ..AdaptiveLif::default() };
    for (current, rate) in [(2.0, 44.3194), (5.0, 122.5965), (10.0, 212.1078)] {
        let out = run(&model, &[current], &[0.0; 3], (7_000, 1));
        let spikes = out.slice(ndarray::s![5_000.., 0]).sum() / 2.0;
        assert!((spikes - rate).abs() < 1.5, "{current}: {spikes} {rate}");
        let out = run(&AdaptiveLifRate(model), &[current], &[0.0], (5_000, 1));
        assert!((out[(4_999, 0)] - rate).abs() < 1e-3, "{current}: {}", out[(4_999, 0)]);
        // The wrong variant: without adaptation.
        assert!(Lif::default().rate(f64::from(current)) > rate + 15.0);
    }
}
