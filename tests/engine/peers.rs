//! Behaviours that the test suite of Nengo 4.1 checks, written with this crate's interface. `tests/spa/peers.rs` has
//! those of nengo_spa 2.0; together they are 60.
//!
//! The table names what is checked in our words and, for reference, the file and the test of the suite that checks the
//! like. Models, numbers and bounds are those of the suite where they are part of the behaviour. No code is taken.
//! Left out of the list are tests of Python's own matters (pickles, warnings, configuration, the order of operators).
//!
//! | behaviour | in Nengo's suite | verdict |
//! |---|---|---|
//! | `encoders_gains_and_biases_are_those_given`: encoders are scaled to length 1 unless kept; gains and biases stay | test_ensemble: test_encoders, test_no_norm_encoders, test_gain_bias | passes |
//! | `every_model_represents_a_constant_vector` within 0.1 | test_ensemble: test_constant_vector | passes |
//! | `evaluation_points_fill_the_ball_of_the_radius` | test_ensemble: test_eval_points_scaling | passes |
//! | `noise_on_currents_raises_or_lowers_activity` | test_ensemble: test_noise_gen | passes |
//! | `spikes_come_as_often_as_the_tuning_curve_says` | test_neurons: test_lif | passes |
//! | `without_a_refractory_time_a_neuron_fires_in_every_tick` | test_neurons: test_lif_zero_tau_ref | passes |
//! | `adaptive_spikes_and_rates_agree` within 7% | test_neurons: test_alif | passes |
//! | `six_kinds_of_izhikevich_neurons_fire_as_in_the_reference` | test_neurons: test_izhikevich | passes |
//! | `spikes_made_from_rates_decode_like_the_rates` | test_neurons: test_spiking_types | passes |
//! | `activity_does_not_depend_on_the_tick` | test_neurons: test_dt_dependence | passes |
//! | `neurons_start_where_they_are_told` | test_neurons: test_initial_state, test_bad_initial_state | passes |
//! | `a_voltage_floor_below_zero_gives_inhibition_a_memory` | test_neurons: test_lif_min_voltage | passes |
//! | `voltages_refractory_times_and_adaptation_are_probed` | test_neurons: test_probeable | passes |
//! | `a_value_inhibits_neurons` | test_connection: test_node_to_neurons | passes |
//! | `an_ensemble_and_its_neurons_inhibit_neurons` | test_connection: test_ensemble_to_neurons, test_neurons_to_neurons | passes |
//! | `a_function_is_transformed_after_it_is_decoded` | test_connection: test_function_and_transform | passes |
//! | `slices_and_repeated_indices_reach_what_they_name` | test_connection: test_slicing, test_list_indexing, test_slicing_function | passes |
//! | `full_weights_act_as_decoders_and_encoders_do` | test_solvers: test_weight_solver; test_connection: test_set_weight_solver | passes |
//! | `a_function_given_by_points_is_decoded` | test_connection: test_function_points | passes |
//! | `a_sparse_transform_is_the_dense_one` | test_transforms: test_sparse, test_sparse_nef | passes |
//! | `pes_learns_a_vector_from_zero_decoders` | test_learning_rules: test_pes_ens_ens | passes |
//! | `pes_learns_weights_between_neurons` | test_learning_rules: test_pes_neuron_neuron | passes |
//! | `pes_learns_one_component_of_a_recurrent_ensemble`, and each component from an error of its own | test_learning_rules: test_pes_recurrent_slice, test_slicing | passes |
//! | `oja_and_bcm_change_weights_alone_and_together` | test_learning_rules: test_unsupervised | passes |
//! | `voja_moves_the_encoders_of_active_neurons_to_the_input` and no others | test_learning_rules: test_voja_encoders | passes |
//! | `voja_stops_when_told` | test_learning_rules: test_voja_modulate | passes |
//! | `rls_learns_vectors_from_rates_and_spikes` | test_learning_rules: test_rls_scalar_rate, test_rls_scalar_spiking, test_rls_multidim | passes |
//! | `a_rule_of_ones_own_may_have_any_signal` | test_learning_rules: test_custom_type | passes |
//! | `states_of_rules_are_probed_and_reset` | test_learning_rules: test_probeable, test_reset | passes |
//! | `alpha_and_triangle_are_convolutions` | test_synapses: test_alpha, test_triangle, test_filt | passes |
//! | `two_low_passes_combine_into_a_linear_filter` | test_synapses: test_linearfilter_combine | passes |
//! | `white_noise_has_a_flat_spectrum_that_grows_as_the_tick_shrinks` | test_processes: test_gaussian_whitenoise | passes |
//! | `a_white_signal_has_its_power_its_start_and_no_seam` | test_processes: test_whitesignal_rms, test_whitesignal_y0, test_whitesignal_continuity, test_whitesignal_high_errors | passes |
//! | `processes_repeat_after_a_reset_and_differ_by_seed` | test_processes: test_reset, test_seed | passes |
//! | `inputs_are_presented_in_turn_and_piecewise` | test_processes: test_present_input, TestPiecewise | passes |
//! | `decoders_that_are_not_negative_fit_a_square` | test_solvers: test_nnls, test_nosolver | passes |
//! | `all_solvers_decode_a_ramp_in_spikes` | test_solvers: test_compare_solvers | passes |
//! | `an_array_of_ensembles_has_functions_and_inhibition` | networks/test_ensemblearray: test_multifunc, test_neuroninput | passes |

mod connections;
mod learning;
mod neurons;
mod signals;

use symbolt::prelude::*;
use symbolt::sim::{Kind, ProbeId, Real, Signal, Vector};

pub use crate::things::{lif, rate};

pub fn ms(millis: u64) -> SimDuration {
    SimDuration::from_millis(millis)
}

/// A probe behind a low-pass.
pub fn smooth(tau_ms: u64) -> ProbeSpec {
    ProbeSpec::default().filtered(Synapse::lowpass_ms(tau_ms))
}

pub fn run(graph: &GraphBuilder, plan: &PopulationPlan, millis: u64) -> Simulator {
    graph.run(plan, Seed::new(1), ms(millis)).expect("runs")
}

/// A sine of one hertz in each component, each a quarter of a period later.
pub fn sines(width: usize) -> Signal<Vector> {
    Signal::vector(width, |t, out| {
        for (at, out) in out.iter_mut().enumerate() {
            *out = (std::f64::consts::TAU * (t - 0.25 * at as f64)).sin() as Real;
        }
    })
}

/// All samples of a probe.
pub fn samples(sim: &Simulator, probe: &ProbeId<Vector>) -> Vec<Vec<Real>> {
    sim.samples(probe).iter().map(|(_, value)| value.to_vec()).collect()
}

/// The mean of the samples from one tick to another.
pub fn mean(sim: &Simulator, probe: &ProbeId<Vector>, from: usize, to: usize) -> Vec<Real> {
    let all = samples(sim, probe);
    assert!(from < to && to <= all.len(), "{from} to {to} of {}", all.len());
    let of = |at: usize| all[from..to].iter().map(|v| v[at]).sum::<Real>() / (to - from) as Real;
    (0..all[0].len()).map(of).collect()
}

/// Checks numbers within a bound.
#[track_caller]
pub fn near(found: &[Real], wanted: &[Real], bound: Real) {
    assert_eq!(found.len(), wanted.len());
    let off = found.iter().zip(wanted).map(|(f, w)| (f - w).abs());
    assert!(off.fold(0.0, Real::max) <= bound, "{found:?} instead of {wanted:?}");
}

/// The root of the mean square.
pub fn rms(values: impl IntoIterator<Item = Real>) -> Real {
    let (sum, count) = values.into_iter().fold((0.0, 0), |(s, n), v| (s + v * v, n + 1));
    assert!(count > 0);
    (sum / count as Real).sqrt()
}

/// Why a graph is not built.
pub fn refused(graph: &GraphBuilder) -> String {
    graph.run(&lif(), Seed::new(1), ms(1)).err().expect("refused").to_string()
}

/// The number of samples of a probe.
pub fn count<K: Kind>(sim: &Simulator, probe: &ProbeId<K>) -> usize {
    sim.samples(probe).len()
}

#[test]
fn every_behaviour_of_the_list_has_its_test() {
    let sources = [
        include_str!("peers/connections.rs"),
        include_str!("peers/learning.rs"),
        include_str!("peers/neurons.rs"),
        include_str!("peers/signals.rs"),
    ];
    let tests = sources.concat();
    let rows = include_str!("peers.rs").lines().filter(|line| line.starts_with("//! |")).skip(2);
    let mut count = 0;
    for row in rows {
        assert!(row.ends_with("| passes |"), "{row}");
        let name = row.split('`').nth(1).expect("a name");
        assert!(tests.contains(&format!("#[test]\nfn {name}()")), "{name}");
        count += 1;
    }
    assert_eq!(count, 38);
    assert_eq!(tests.matches("#[test]\n").count(), count, "tests that the list lacks");
}
