//! Compares the passes over an ensemble, encoding by transforms and decoding, with plain loops.

use rand::RngExt;

use super::shape::SPAN;
use super::*;
use crate::neurons::models::Lif;

fn shape(neurons: usize, dims: usize) -> Shape {
    Shape { ensembles: 1, neurons, dims, outputs: 1, hadamard: true }
}

/// Encoders and gains of an ensemble, and what the hot loop reads.
fn drawn(shape: &Shape, seed: u64) -> (Vec<f64>, Vec<f64>, Vec<Real>) {
    let mut rng = Seed::new(seed).rng();
    let encoders = hadamard::directions(&mut rng, shape);
    let gains: Vec<f64> = (0..shape.neurons).map(|_| 1.0 + 20.0 * rng.random::<f64>()).collect();
    let laid_out = hadamard::lay_out(shape, &gains, &encoders);
    (encoders, gains, laid_out)
}

fn value(dims: usize) -> Vec<Real> {
    (0..dims).map(|k| (1.3 * k as Real + 0.4).sin() * 0.3).collect()
}

/// Greatest difference between currents of neurons that share a current of 1, and gain times encoder times value.
fn off((encoders, gains): (&[f64], &[f64]), laid_out: &[Real], dims: usize) -> f64 {
    let (biases, mut currents) = (vec![1.0; laid_out.len()], vec![0.0; laid_out.len()]);
    hadamard::encode(laid_out, &biases, 0.25, &value(dims), &mut currents);
    assert!(currents[gains.len()..].iter().all(|padding| *padding == 1.25));
    let rows = encoders.chunks_exact(dims).zip(gains).zip(&currents);
    let off = rows.map(|((encoder, gain), current)| {
        let along: f64 = encoder.iter().zip(value(dims)).map(|(e, x)| e * f64::from(x)).sum();
        (f64::from(*current) - 1.25 - gain * along).abs()
    });
    off.fold(0.0, f64::max)
}

#[test]
fn currents_by_transforms_are_products_of_encoders_and_value() {
    for dims in [2, 3, 5, 8, 15, 16, 17, 24, 33, 64, 100, 128] {
        for neurons in [1, 7, 50, 127, 128, 129, 800, 1_000] {
            let shape = shape(neurons, dims);
            let (encoders, gains, laid_out) = drawn(&shape, 1);
            assert_eq!(laid_out.len(), neurons.next_multiple_of(dims.next_power_of_two().max(8)));
            let right = off((&encoders, &gains), &laid_out, dims);
            assert!(right < 2e-5, "{neurons} neurons, {dims} dimensions: {right}");
            // The wrong variant: one column of a block has the other sign.
            let mut wrong = laid_out;
            wrong[0] = Real::from_bits(wrong[0].to_bits() ^ 1);
            let wrong = off((&encoders, &gains), &wrong, dims);
            assert!(wrong > 0.01, "{neurons} neurons, {dims} dimensions: {wrong}");
        }
    }
}

#[test]
fn encoders_of_a_block_are_at_right_angles_and_of_length_1() {
    let encoders = drawn(&shape(256, 16), 2).0;
    let rows: Vec<&[f64]> = encoders.chunks_exact(16).collect();
    // Neurons of a block lie eight apart.
    for (a, b) in (0..128).step_by(8).flat_map(|a| (0..128).step_by(8).map(move |b| (a, b))) {
        let product: f64 = rows[a + 3].iter().zip(rows[b + 3]).map(|(x, y)| x * y).sum();
        assert!((product - f64::from(u8::from(a == b))).abs() < 1e-12, "{a} {b}: {product}");
    }
    let distinct: std::collections::BTreeSet<Vec<bool>> =
        rows.iter().map(|row| row.iter().map(|x| *x < 0.0).collect()).collect();
    assert!(distinct.len() > 250, "blocks have signs of their own: {}", distinct.len());
    assert_eq!(encoders, drawn(&shape(256, 16), 2).0);
    assert_ne!(encoders, drawn(&shape(256, 16), 3).0);
}

/// The transform of one block at a time, in the order of additions that the module describes.
fn encode_plainly(laid_out: &[Real], value: &[Real], order: usize) -> Vec<Real> {
    let mut currents = vec![0.0; laid_out.len()];
    for start in (0..laid_out.len()).step_by(128) {
        let all = &laid_out[start..laid_out.len().min(start + 128)];
        let lanes = all.len() / order;
        for lane in 0..lanes {
            let at = |row: usize| all[row * lanes + lane];
            let x = |row: usize| value.get(row).copied().unwrap_or(0.0);
            let flipped = |row: usize| if at(row).to_bits() & 1 == 1 { -x(row) } else { x(row) };
            let mut block: Vec<Real> = (0..order).map(flipped).collect();
            let mut run = 1;
            while run < order {
                for row in (0..order).filter(|row| row & run == 0) {
                    let (a, b) = (block[row], block[row + run]);
                    (block[row], block[row + run]) = (a + b, a - b);
                }
                run *= 2;
            }
            for (row, product) in block.iter().enumerate() {
                currents[start + row * lanes + lane] = 0.5 + 0.25 + at(row) * product;
            }
        }
    }
    currents
}

#[test]
fn currents_by_transforms_have_the_same_bits_whatever_the_width_of_registers() {
    for (neurons, dims) in [(800, 16), (130, 16), (300, 8), (77, 3), (500, 64), (700, 100)] {
        let laid_out = drawn(&shape(neurons, dims), 3).2;
        let (biases, mut currents) = (vec![0.5; laid_out.len()], vec![0.0; laid_out.len()]);
        hadamard::encode(&laid_out, &biases, 0.25, &value(dims), &mut currents);
        let plain = encode_plainly(&laid_out, &value(dims), dims.next_power_of_two());
        let bits = |all: &[Real]| all.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert!(bits(&currents) == bits(&plain), "{neurons} neurons, {dims} dimensions");
        assert!(currents.iter().any(|current| (current - 0.75).abs() > 0.1));
    }
}

#[test]
fn decoding_adds_the_rows_of_active_neurons_in_their_order() {
    let mut rng = Seed::new(4).rng();
    for outputs in 1..=20 {
        for neurons in [1, 8, 63, 64, 65, 200, SPAN] {
            let one_in_ten = |u: f64| if u < 0.1 { 1.0 + u as Real } else { 0.0 };
            let activity: Vec<Real> = (0..neurons).map(|_| one_in_ten(rng.random())).collect();
            let rows: Vec<Real> = (0..neurons * outputs).map(|_| rng.random()).collect();
            let (mut out, mut plain) = (vec![0.5; outputs], vec![0.5; outputs]);
            decode::add_rows(&activity, &rows, &mut out);
            for (row, activity) in rows.chunks_exact(outputs).zip(&activity) {
                plain.iter_mut().zip(row).for_each(|(sum, decoder)| *sum += activity * decoder);
            }
            assert!(out == plain, "{neurons} neurons, {outputs} outputs");
            assert!(neurons < 60 || out.iter().all(|sum| *sum > 0.5));
        }
    }
}

#[test]
fn a_neuron_of_sixteen_dimensions_reads_one_number_for_its_encoder() {
    let numbers = |hadamard: bool| {
        let shape = Shape { ensembles: 2, neurons: 100, dims: 16, outputs: 16, hadamard };
        let lif = Lif::default();
        let draft = |_, seed: Seed| {
            let spec = crate::neurons::plan::NeuronSpec::default();
            let neurons = spec.directions(&shape, &mut seed.rng())?;
            let values: Vec<f64> =
                (0..16 * 200).map(|i| (f64::from(i) * 0.7).sin() / 4.0).collect();
            let points = Points { wanted: values.clone(), values, outputs: 16 };
            Ok(Draft { neurons, radius: 1.0, points })
        };
        let solved = Recipe::of(&lif, 0.001, shape).solve(draft).expect("solvable");
        let second = solved.only(vec![1]);
        assert_eq!(second.encoders, solved.encoders[solved.encoders.len() / 2..]);
        solved.encoders.len()
    };
    // Padded to whole blocks of 16, and to whole groups of 32.
    assert_eq!(numbers(true), 2 * 112);
    assert_eq!(numbers(false), 2 * 128 * 16);
}
