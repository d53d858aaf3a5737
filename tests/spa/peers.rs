//! Behaviours that the test suite of nengo_spa 2.0 checks, written with this crate's interface. `tests/engine/peers.rs`
//! has those of Nengo 4.1 and says how both lists were made; together they are 60.
//!
//! | behaviour | in the suite of nengo_spa | verdict |
//! |---|---|---|
//! | `a_state_follows_its_input_and_forgets_it` | modules/test_state: test_no_feedback_run | passes |
//! | `a_recurrent_state_remembers_and_a_leaky_one_decays` | modules/test_state: test_memory_run, test_memory_run_decay | passes |
//! | `two_states_are_bound_and_unbound` | modules/test_bind: test_run, test_unbind | passes |
//! | `two_states_are_compared` | modules/test_compare: test_run | passes |
//! | `a_threshold_maps_between_vocabularies_of_two_sizes` | modules/test_associative_memory: test_am_threshold | passes |
//! | `of_two_similar_items_the_greater_wins` and after a pause the other | modules/test_associative_memory: test_am_wta; networks/test_selection: test_wta | passes |
//! | `accumulators_keep_their_choice_until_they_are_reset` | modules/test_associative_memory: test_am_ia; networks/test_selection: test_ia | passes |
//! | `a_memory_has_an_answer_where_nothing_is_similar` | modules/test_associative_memory: test_am_default_output | passes |
//! | `keys_and_values_may_be_expressions` | modules/test_associative_memory: test_am_spa_keys_as_expressions | passes |
//! | `utilities_are_thresholded_each_by_itself`, as steps and graded | networks/test_selection: test_thresholding_array | passes |
//! | `utilities_may_be_any_expression` | modules/test_basalganglia: test_basal_ganglia, test_scalar_product | passes |
//! | `rules_route_bind_and_invert` what their effects name | modules/test_thalamus: test_thalamus, test_routing | passes |
//! | `functions_encode_and_decode_pointers` | modules/test_transcode: test_encode_with_input, test_decode | passes |
//! | `pointers_are_translated_and_reinterpreted` | tests/test_network: test_casting_vocabs; ast/test_dynamic: test_dynamic_translate | passes |
//! | `an_expression_over_modules_is_that_over_pointers` in both algebras | ast/test_dynamic: test_complex_rule; networks/test_vtb: test_bind, test_unbind | passes |
//! | `a_gated_memory_holds_what_it_was_given` | Nengo, networks/test_workingmemory: test_inputgatedmemory | passes |
//! | `vocabularies_are_populated_parsed_and_cut` | tests/test_vocabulary: test_populate, test_parse, test_subset, test_transform | passes |
//! | `algebras_obey_their_laws` | algebras/test_algebras: test_binding_and_invert, test_integer_binding_power, test_fractional_binding_power, test_identity_element, test_zero_element | passes |
//! | `the_product_of_two_matrices_is_bound_and_unbound_on_either_side`, by transposed vector-derived transformations | networks/test_tvtb: test_bind, test_unbind | passes |
//! | `vectors_are_drawn_with_the_properties_asked_for` | tests/test_vector_generation: test_unit_length_pointers, test_unitary_pointers, test_orthonormal_pointers, test_axis_aligned_pointers | passes |
//! | `traces_are_told_in_similarities_and_words` | tests/test_examine: test_similarity, test_pairs, test_text | passes |
//! | `numbers_and_pointers_are_added_and_multiplied` | ast/test_dynamic: test_scalar_addition, test_dot, test_pointer_symbol_with_dynamic_scalar; ast/test_symbolic: test_product_of_scalars | passes |

mod choices;
mod flows;
mod vectors;

use symbolt::prelude::*;
use symbolt::sim::{ProbeId, Real};

symbolt::vocabulary!(pub Words = "words": A, B, C, D, E, F, G, H, CAT, DOG, PARROT, MOUSE, SHOOP);
symbolt::vocabulary!(pub Others = "others": A, B, C, D);

pub fn ms(millis: u64) -> SimDuration {
    SimDuration::from_millis(millis)
}

pub fn lif() -> PopulationPlan {
    PopulationPlan::lif()
}

/// A vocabulary of any tag.
pub fn words<V: VocabTag>(dim: usize, seed: u64, names: &[&str]) -> Vocabulary<V> {
    let builder = VocabularyBuilder::<V>::new(dim, Seed::new(seed)).or_best_of(200);
    builder.pointers(names.iter().copied()).build().expect("sound")
}

pub fn run(graph: &GraphBuilder, millis: u64) -> Simulator {
    graph.run(&lif(), Seed::new(1), ms(millis)).expect("runs")
}

pub fn smooth(tau_ms: u64) -> ProbeSpec {
    ProbeSpec::default().filtered(Synapse::lowpass_ms(tau_ms))
}

/// The mean dot product of a trace with an expression, from one tick to another.
pub fn like<V: VocabTag>(
    vocabulary: &Vocabulary<V>,
    sim: &Simulator,
    probe: &ProbeId<Pointer<V>>,
    text: &str,
    (from, to): (usize, usize),
) -> Real {
    let wanted = vocabulary.parse(text).expect("an expression");
    let of = |at: usize| dot(&sim.samples(probe).get(at).expect("recorded").1, &wanted);
    (from..to).map(of).sum::<Real>() / (to - from) as Real
}

/// The mean of the samples of a vector from one tick to another.
pub fn mean(sim: &Simulator, probe: &ProbeId<Vector>, (from, to): (usize, usize)) -> Vec<Real> {
    let all: Vec<Vec<Real>> = sim.samples(probe).iter().map(|(_, v)| v.to_vec()).collect();
    let of = |at: usize| all[from..to].iter().map(|v| v[at]).sum::<Real>() / (to - from) as Real;
    (0..all[0].len()).map(of).collect()
}

#[test]
fn every_behaviour_of_the_list_has_its_test() {
    let sources = [
        include_str!("peers/choices.rs"),
        include_str!("peers/flows.rs"),
        include_str!("peers/vectors.rs"),
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
    assert_eq!(count, 22);
    assert_eq!(tests.matches("#[test]\n").count(), count, "tests that the list lacks");
}
