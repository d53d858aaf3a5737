//! Distances, clusters and means of poses, and sets of states.

use symbolt::robot::{Pose, mean_orientation, rotation_between};
use symbolt::task::learn::{
    Dendrogram, MAX_POINTS, PoseGaussian, distance_matrix, p_distance, robust_mean,
};
use symbolt::task::{Offset, StateId, TaskError, WorldState};

/// The formula of the definition.
fn formula(u: &[f64; 3], v: &[f64; 3], p: f64) -> f64 {
    u.iter().zip(v).map(|(a, b)| (a - b).abs().powf(p)).sum::<f64>().powf(1.0 / p)
}

#[test]
fn the_quick_form_equals_the_definition() {
    let points = [[0.3507, 0.0016, 0.0863], [-0.0255, 0.0522, -0.6767], [0.1256, 0.0644, -0.5296]];
    let mut checked = 0;
    for u in &points {
        for v in &points {
            if u != v {
                for p in [-2.0, -3.0, 2.0, 1.0] {
                    let (quick, exact) = (p_distance(u, v, p), formula(u, v, p));
                    assert!((quick / exact - 1.0).abs() < 1e-12, "{u:?} {v:?} {p}");
                    checked += 1;
                }
            }
        }
    }
    assert_eq!(checked, 24);
}

#[test]
fn a_coordinate_difference_of_zero_makes_the_distance_zero() {
    let (u, v) = ([0.1, 0.2, 0.3], [0.9, 0.2, -0.7]);
    assert_eq!(p_distance(&u, &v, -2.0), 0.0);
    assert_eq!(p_distance(&u, &v, -3.0), 0.0);
    assert!(p_distance(&u, &v, 2.0) > 1.0);
    assert_eq!(distance_matrix(&[u, v], -2.0), [0.0]);
    for p in [-2.0, -0.5, 1.0, 2.0] {
        assert_eq!(p_distance(&u, &u, p), 0.0);
    }
    // The limit: the distance shrinks with the difference.
    let nearly = p_distance(&u, &[0.9, 0.2 + 1e-12, -0.7], -2.0);
    assert!(nearly > 0.0 && nearly <= 1.001e-12, "{nearly}");
}

#[test]
fn extreme_coordinates_neither_overflow_nor_vanish() {
    for scale in [1e-120, 1e-9, 1e6, 1e120] {
        let d = p_distance(&[scale; 3], &[2.0 * scale; 3], -2.0);
        assert!((d / (scale / 3f64.sqrt()) - 1.0).abs() < 1e-12, "{scale} {d}");
    }
}

#[test]
fn the_matrix_holds_every_pair_in_order() {
    let points: Vec<[f64; 3]> =
        (0..40).map(|i| [f64::from(i).sin(), f64::from(i).cos(), f64::from(i) * 0.1]).collect();
    for p in [-2.0, -3.0] {
        let matrix = distance_matrix(&points, p);
        let mut at = 0;
        for i in 0..40 {
            for j in i + 1..40 {
                assert_eq!(matrix[at], p_distance(&points[i], &points[j], p));
                at += 1;
            }
        }
        assert_eq!(at, matrix.len());
    }
    assert!(distance_matrix(&[], -2.0).is_empty());
    assert!(distance_matrix(&points[..1], -2.0).is_empty());
}

fn points(n: usize) -> Vec<[f64; 3]> {
    let wave = |i: usize, k: f64| ((i as f64 + 1.0) * k).sin();
    (0..n).map(|i| [wave(i, 1.7), wave(i, 2.3), wave(i, 0.9)]).collect()
}

/// Average linkage by its definition: repeatedly merges the two clusters with the smallest mean pairwise distance.
fn brute_force(points: &[[f64; 3]], p: f64) -> Vec<f64> {
    let mut clusters: Vec<Vec<usize>> = (0..points.len()).map(|i| vec![i]).collect();
    let mut heights = Vec::new();
    while clusters.len() > 1 {
        let (mut best, mut pair) = (f64::INFINITY, (0, 1));
        for i in 0..clusters.len() {
            for j in i + 1..clusters.len() {
                let mut sum = 0.0;
                for a in &clusters[i] {
                    for b in &clusters[j] {
                        sum += p_distance(&points[*a], &points[*b], p);
                    }
                }
                let mean = sum / (clusters[i].len() * clusters[j].len()) as f64;
                if mean < best {
                    (best, pair) = (mean, (i, j));
                }
            }
        }
        let taken = clusters.swap_remove(pair.1);
        clusters[pair.0].extend(taken);
        heights.push(best);
    }
    heights
}

fn tree(points: &[[f64; 3]]) -> Dendrogram {
    match Dendrogram::new(points, -2.0, "part") {
        Ok(tree) => tree,
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn heights_are_those_of_the_definition() {
    let points = points(30);
    let (tree, expected) = (tree(&points), brute_force(&points, -2.0));
    assert_eq!(tree.merges().len(), 29);
    for (merge, height) in tree.merges().iter().zip(expected) {
        assert!((merge.height - height).abs() < 1e-12, "{merge:?} {height}");
    }
}

#[test]
fn cuts_and_join_heights_tell_the_same_story() {
    let points = points(40);
    let tree = tree(&points);
    let pairs: Vec<(usize, usize)> = (0..40).flat_map(|i| (0..40).map(move |j| (i, j))).collect();
    let joins = tree.join_heights(&pairs);
    let mut checked = 0;
    for merge in tree.merges().iter().step_by(5) {
        let labels = tree.cut(merge.height);
        let distinct = labels.iter().max().map_or(0, |m| m + 1);
        assert_eq!(distinct, tree.count_at(merge.height));
        assert_eq!(tree.next_merge(merge.height), Some(merge.height));
        for ((i, j), join) in pairs.iter().zip(&joins) {
            assert_eq!(labels[*i] == labels[*j], *join < merge.height || i == j);
            checked += 1;
        }
    }
    assert!(checked > 10_000);
    assert_eq!(tree.cut(f64::INFINITY), vec![0; 40]);
    assert_eq!(tree.cut(0.0), (0..40).collect::<Vec<_>>());
}

#[test]
fn none_and_one_point_are_no_special_trouble() {
    assert!(tree(&[]).cut(1.0).is_empty());
    assert_eq!(tree(&[[0.0; 3]]).cut(1.0), [0]);
    assert_eq!(tree(&[[0.0; 3]]).next_merge(0.0), None);
}

#[test]
fn too_many_points_are_refused_before_memory_is() {
    let many = vec![[0.0; 3]; MAX_POINTS + 1];
    assert!(matches!(
        Dendrogram::new(&many, -2.0, "nut"),
        Err(TaskError::TooManyPoses { poses: 20_001, .. })
    ));
}

#[test]
fn a_tenth_at_each_end_is_dropped() {
    let mut values: Vec<f64> = (0..20).map(f64::from).collect();
    values[19] = 1e9;
    values[0] = -1e9;
    // Dropping 2 of 20 values at each end leaves 2 to 17.
    assert_eq!(robust_mean(&mut values), 9.5);
    // With fewer than ten values, no value is dropped.
    assert_eq!(robust_mean(&mut [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 9.0]), 1.0);
    assert_eq!(robust_mean(&mut []), 0.0);
}

#[test]
fn an_offset_is_said_in_words() {
    let said = |off_m: f64, high_m: f64, degrees: f64| {
        Offset { off_m, high_m, off_rad: degrees.to_radians(), turned: false }.in_words()
    };
    assert_eq!(said(2.6e-3, 2.6e-3, 10.0), "2.6 mm too high and tilted by 10 degrees");
    assert_eq!(said(5e-3, -4e-3, 20.0), "4.0 mm too low, 3.0 mm aside and tilted by 20 degrees");
    assert_eq!(said(2e-4, 0.0, 0.0), "0.2 mm off");
    assert_eq!(said(0.0, 0.0, 12.0), "tilted by 12 degrees");
}

fn about_z(degrees: f64) -> [f64; 4] {
    let half = degrees.to_radians() / 2.0;
    [0.0, 0.0, half.sin(), half.cos()]
}

#[test]
fn the_mean_of_two_turns_is_halfway_whatever_their_signs() {
    let expected = about_z(30.0);
    for sign in [1.0, -1.0] {
        let other = about_z(60.0).map(|v| v * sign);
        let mean = mean_orientation(&[about_z(0.0), other]).unwrap_or_default();
        for (a, b) in mean.iter().zip(expected) {
            assert!((a - b).abs() < 1e-12, "{mean:?}");
        }
    }
}

#[test]
fn a_componentwise_mean_would_be_caught() {
    // The componentwise mean fails here: with one sign flipped, the components nearly cancel.
    let flipped = about_z(2.0).map(|v| -v);
    let naive: Vec<f64> = about_z(0.0).iter().zip(flipped).map(|(a, b)| (a + b) / 2.0).collect();
    let length = naive.iter().map(|v| v * v).sum::<f64>().sqrt();
    assert!(length < 0.02);
    let mean = mean_orientation(&[about_z(0.0), flipped]).unwrap_or_default();
    assert!((mean[3] - about_z(1.0)[3]).abs() < 1e-12);
}

#[test]
fn a_rotation_is_measured_the_short_way() {
    let from = Pose { orientation: about_z(0.0), ..Pose::at([0.0; 3]) };
    let to = Pose { orientation: about_z(350.0), ..from };
    let turn = rotation_between(&from, &to);
    assert!((turn[2] + 10f64.to_radians()).abs() < 1e-12, "{turn:?}");
}

#[test]
fn a_world_is_the_set_of_states_that_hold() {
    let mut world: WorldState = [true, false, true].into_iter().collect();
    assert_eq!((world.states(), world.len()), (3, 2));
    assert_eq!(world.iter().map(StateId::index).collect::<Vec<_>>(), [0, 2]);
    world.remove(StateId::new(0));
    world.insert(StateId::new(1));
    assert_eq!(world.flags(), [false, true, true]);
    assert!(!world.holds(StateId::new(7)) && !world.is_empty());
    assert!(WorldState::empty(2).is_empty());
    assert_eq!(format!("{world:?}"), "WorldState([1, 2] of 3)");
}

#[test]
fn the_covariance_is_that_of_the_definition() {
    let at = |x: f64, y: f64, degrees: f64| {
        let half = degrees.to_radians() / 2.0;
        Pose { position: [x, y, 0.0], orientation: [0.0, 0.0, half.sin(), half.cos()] }
    };
    let poses = [at(0.0, 0.0, -10.0), at(2.0, 4.0, 10.0)];
    let fit = PoseGaussian::fit(&poses).map(|g| g.covariance).unwrap_or_default();
    let turn = 10f64.to_radians();
    let expected =
        [(0, 0, 2.0), (1, 1, 8.0), (0, 1, 4.0), (5, 5, 2.0 * turn * turn), (0, 5, 2.0 * turn)];
    for (i, j, value) in expected {
        assert!((fit[i][j] - value).abs() < 1e-12, "{i} {j} {}", fit[i][j]);
        assert_eq!(fit[i][j], fit[j][i]);
    }
    assert_eq!(fit[2][2], 0.0);
}

#[test]
fn one_upset_orientation_in_ten_does_not_move_the_mean() {
    let mut poses = vec![Pose::at([0.0; 3]); 9];
    poses.push(Pose { orientation: [1.0, 0.0, 0.0, 0.0], ..poses[0] });
    let mean = PoseGaussian::fit(&poses).map(|g| g.mean.orientation).unwrap_or_default();
    assert!((mean[3] - 1.0).abs() < 1e-12, "{mean:?}");
}

#[test]
fn no_poses_have_no_model_and_one_has_no_spread() {
    assert_eq!(PoseGaussian::fit(&[]), None);
    let one = PoseGaussian::fit(&[Pose::at([1.0, 2.0, 3.0])]);
    assert_eq!(one.map(|g| g.covariance), Some([[0.0; 6]; 6]));
}
