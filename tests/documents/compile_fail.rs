//! Mistakes that the compiler rejects, each with a working twin one change away, as doc tests.
//!
//! `docs/mistakes.md` shows them to modellers, with the compiler's messages. `tests/documents/mistakes.rs` checks that
//! both list the same ones, and has the mistakes that only the builder finds. Stable rustdoc does not check the error
//! codes; they were read from the compiler's output.

/// The program around each mistake, in two parts.
macro_rules! program {
    (before) => {
        r#"
use symbolt::prelude::*;

symbolt::vocabulary!(Parts = "parts": NUT, BOLT);
symbolt::vocabulary!(Verbs = "verbs": TAKE, NUT);

#[deny(unused_must_use)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let parts = Parts::vocabulary(64, Seed::new(1))?;
    let verbs = Verbs::vocabulary(64, Seed::new(2))?;
    let mut graph = GraphBuilder::new();
    let seen = graph.add("seen", State::new(&parts));
    let held = graph.add("held", State::new(&parts));
    let verb = graph.add("verb", State::new(&verbs));
    let level = graph.add("level", Add::scalar());
"#
    };
    (after) => {
        "\nOk(())\n}\n```\n"
    };
}

macro_rules! mistakes {
    ($($name:ident $fence:literal $wrong:literal $right:literal)*) => {$(
        #[doc = concat!("```", $fence, program!(before), $wrong, program!(after))]
        #[doc = concat!("```", program!(before), $right, program!(after))]
        mod $name {}
    )*};
}

mistakes! {
    bound_to_another_vocabulary "compile_fail,E0277"
    r#"graph.route(&seen * &verb >> &held);"#
    r#"graph.route(&seen * &held >> &held);"#

    added_to_another_vocabulary "compile_fail,E0271"
    r#"graph.route(&seen + &verb >> &held);"#
    r#"graph.route(&seen + &held >> &held);"#

    unbound_by_another_vocabulary "compile_fail,E0277"
    r#"graph.route(&seen * !Verbs::NUT >> &held);"#
    r#"graph.route(&seen * !Parts::NUT >> &held);"#

    routed_to_another_vocabulary "compile_fail,E0277"
    r#"graph.route(&seen >> &verb);"#
    r#"graph.route(&seen >> &held);"#

    routed_by_a_rule "compile_fail,E0277"
    r#"graph.add("rules", Rules::new().rule("see", &level, [&seen >> &verb]));"#
    r#"graph.add("rules", Rules::new().rule("see", &level, [&seen >> &held]));"#

    compared_in_a_rule "compile_fail,E0271"
    r#"graph.add("rules", Rules::new().rule("see", seen.dot(Verbs::NUT), []));"#
    r#"graph.add("rules", Rules::new().rule("see", seen.dot(Parts::NUT), []));"#

    scalar_product_of_two_vocabularies "compile_fail,E0271"
    r#"graph.route(seen.dot(&verb) >> &level);"#
    r#"graph.route(seen.dot(&held) >> &level);"#

    cosine_of_two_vocabularies "compile_fail,E0277"
    r#"cosine(&parts.get("NUT")?, &verbs.get("NUT")?);"#
    r#"cosine(&parts.get("NUT")?, &parts.get("NUT")?);"#

    described_by_another_vocabulary "compile_fail,E0277"
    r#"verbs.describe(&parts.get("NUT")?, 0.1);"#
    r#"parts.describe(&parts.get("NUT")?, 0.1);"#

    constant_in_another_space "compile_fail,E0277"
    r#"graph.add("nut", Constant::pointer(verbs.space(), &parts.get("NUT")?));"#
    r#"graph.add("nut", Constant::pointer(parts.space(), &parts.get("NUT")?));"#

    samples_compared_with_another_vocabulary "compile_fail,E0308"
    r#"let probe = graph.probe(&seen.output, ProbeSpec::default());
    graph.route(Parts::NUT >> &seen);
    graph.route(Parts::NUT >> &held);
    graph.route(Verbs::NUT >> &verb);
    graph.route(1.0 >> &level.input);
    let ms = SimDuration::from_millis(5);
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms)?;
    verbs.similarities(sim.samples(&probe), ["NUT"])?;"#
    r#"let probe = graph.probe(&seen.output, ProbeSpec::default());
    graph.route(Parts::NUT >> &seen);
    graph.route(Parts::NUT >> &held);
    graph.route(Verbs::NUT >> &verb);
    graph.route(1.0 >> &level.input);
    let ms = SimDuration::from_millis(5);
    let sim = graph.run(&PopulationPlan::direct(), Seed::new(1), ms)?;
    parts.similarities(sim.samples(&probe), ["NUT"])?;"#

    number_plus_pointer "compile_fail,E0271"
    r#"graph.route(&seen + 0.5 >> &held);"#
    r#"graph.route(&seen * 0.5 >> &held);"#

    scalar_plus_pointer "compile_fail,E0271"
    r#"graph.route(&seen + &level >> &held);"#
    r#"graph.route(&seen * &level >> &held);"#

    number_into_a_pointer "compile_fail,E0308"
    r#"graph.route(0.5 >> &held.input);"#
    r#"graph.route(0.5 >> &level.input);"#

    scalar_into_a_pointer "compile_fail,E0277"
    r#"graph.route(seen.dot(&held) >> &held);"#
    r#"graph.route(seen.dot(&held) >> &level);"#

    pointer_into_a_gate "compile_fail,E0277"
    r#"let gate = graph.add("gate", Gate::new(&parts));
    graph.route(&seen >> &gate.open);"#
    r#"let gate = graph.add("gate", Gate::new(&parts));
    graph.route(&level >> &gate.open);"#

    inverse_of_a_scalar "compile_fail,E0600"
    r#"graph.route(!&level >> &level);"#
    r#"graph.route(-&level >> &level);"#

    pointer_as_a_utility "compile_fail,E0271"
    r#"graph.add("rules", Rules::new().rule("see", &seen, []));"#
    r#"graph.add("rules", Rules::new().rule("see", &level, []));"#

    whole_number_as_a_factor "compile_fail,E0277"
    r#"graph.route(2 * &seen >> &held);"#
    r#"graph.route(2.0 * &seen >> &held);"#

    connected_across_kinds "compile_fail,E0308"
    r#"graph.connect(&seen.output, &level.input, Synapse::None);"#
    r#"graph.connect(&seen.output, &held.input, Synapse::None);"#

    misspelt_name "compile_fail,E0599"
    r#"graph.route(Parts::NUTS >> &held);"#
    r#"graph.route(Parts::NUT >> &held);"#

    tilde_of_python "compile_fail"
    r#"graph.route(&seen * ~&held >> &held);"#
    r#"graph.route(&seen * !&held >> &held);"#

    operand_by_value "compile_fail,E0369"
    r#"graph.route(seen * &held >> &held);"#
    r#"graph.route(&seen * &held >> &held);"#

    no_target "compile_fail,E0308"
    r#"graph.route(&seen * &held);"#
    r#"graph.route(&seen * &held >> &held);"#

    no_route "compile_fail"
    r#"&seen >> &held;"#
    r#"graph.route(&seen >> &held);"#

    rules_that_are_not_added "compile_fail"
    r#"Rules::new().rule("see", &level, []);"#
    r#"graph.add("rules", Rules::new().rule("see", &level, []));"#

    source_and_target_swapped "compile_fail,E0308"
    r#"graph.connect(&held.input, &seen.output, Synapse::None);"#
    r#"graph.connect(&seen.output, &held.input, Synapse::None);"#

    no_synapse "compile_fail,E0061"
    r#"graph.connect(&seen.output, &held.input);"#
    r#"graph.connect(&seen.output, &held.input, Synapse::None);"#

    time_constant_as_a_number "compile_fail,E0308"
    r#"graph.connect(&seen.output, &held.input, 0.005);"#
    r#"graph.connect(&seen.output, &held.input, Synapse::lowpass_ms(5));"#

    seed_as_a_number "compile_fail,E0308"
    r#"Parts::vocabulary(64, 1)?;"#
    r#"Parts::vocabulary(64, Seed::new(1))?;"#

    probe_of_an_input "compile_fail,E0308"
    r#"graph.probe(&seen.input, ProbeSpec::default());"#
    r#"graph.probe(&seen.output, ProbeSpec::default());"#
}
