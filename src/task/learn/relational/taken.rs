//! Slots that were taken from the beginning: places beside those that were filled, like them, in which things were found and stayed.

use nalgebra::Vector3;

use super::frames::Frames;
use super::motion::Came;
use super::places::{Group, PLACE_M, PLACE_SD};
use super::together::{CHANCE_BOTH, so_many_found};

/// Number of places from which they show how a row or a grid goes on.
const ROW: usize = 3;
/// Distance from the nearest place, as a share of the usual one, from which and up to which a place goes on with a row.
const PITCH: (f64, f64) = (0.7, 1.3);
/// Tilt against the things in other places, in radians, up to which a thing is in a place like theirs.
const TILT_RAD: f64 = 0.2;

/// Several places in which things were put: a row or a grid.
struct Row {
    frame: usize,
    places: Vec<Vector3<f64>>,
    /// The coordinates in which the places agree, and how well.
    agree: [bool; 3],
    exact_m: f64,
    /// Distances from the nearest other place: the least and the greatest.
    pitch: [f64; 2],
    /// The axis that points up, in the frame of a thing in a place.
    upright: Vector3<f64>,
    /// Number of things that were found and that there were in all.
    found: usize,
    all: usize,
}

impl Frames<'_, '_> {
    /// Gives states with several places in a row or a grid of a reference the places like these in which things were found and stayed:
    /// nobody saw them filled, because they were taken.
    pub fn with_taken(&self, mut states: Vec<Vec<Group>>) -> Vec<Vec<Group>> {
        let rows: Vec<Option<Row>> = states.iter().map(|places| self.row(places)).collect();
        for (to, row) in rows.iter().enumerate() {
            let Some(row) = row else { continue };
            for from in (0..states.len()).filter(|from| *from != to && rows[*from].is_none()) {
                let rests: Vec<usize> =
                    states[from].iter().flat_map(|group| group.rests.clone()).collect();
                let taken = self.taken(row, &rests);
                let Some(model) = taken.first().and(states[from].first()) else { continue };
                let place = |rests: &Vec<usize>| Group {
                    rests: rests.clone(),
                    frame: row.frame,
                    scores: model.scores.clone(),
                    ..*model
                };
                let places: Vec<Group> = taken.iter().map(place).collect();
                states[to].extend(places);
                states[from].clear();
            }
        }
        states.retain(|places| !places.is_empty());
        states
    }

    fn row(&self, places: &[Group]) -> Option<Row> {
        let up = self.up?;
        let frame = places.first()?.frame;
        let all: Vec<usize> = places.iter().flat_map(|group| group.rests.clone()).collect();
        let put = all.iter().filter(|rest| self.was_put(**rest)).count();
        if frame == 0 || places.len() < ROW || 2 * put < all.len() {
            return None;
        }
        let middle = |group: &Group| {
            let own = group.rests.iter().filter_map(|rest| self.pose(*rest, frame));
            let own: Vec<Vector3<f64>> = own.map(|pose| Vector3::from(pose.position)).collect();
            (!own.is_empty()).then(|| own.iter().sum::<Vector3<f64>>() / own.len() as f64)
        };
        let places: Vec<Vector3<f64>> = places.iter().map(middle).collect::<Option<_>>()?;
        let exact_m = PLACE_M.max(PLACE_SD * self.motion.noise.position_m);
        let agree = std::array::from_fn(|i| {
            let values = || places.iter().map(|place| place[i]);
            values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min) <= exact_m
        });
        let others = |at: usize| (0..places.len()).filter(move |other| *other != at);
        let nearest = (0..places.len())
            .map(|at| others(at).map(|o| (places[o] - places[at]).norm()).fold(f64::MAX, f64::min));
        let nearest: Vec<f64> = nearest.collect();
        let pitch = [
            nearest.iter().copied().fold(f64::MAX, f64::min),
            nearest.iter().copied().fold(0.0, f64::max),
        ];
        let mut vertical = Vector3::zeros();
        vertical[up] = 1.0;
        let upright = self.motion.rests[*all.first()?].pose.rotation().inverse() * vertical;
        let found = all.len() - put;
        // A heap is no row.
        (agree[up] && pitch[0] > 2.0 * exact_m).then_some(Row {
            frame,
            places,
            agree,
            exact_m,
            pitch,
            upright,
            found,
            all: all.len(),
        })
    }

    /// Returns the places of some rests, if all of them are places that go on with a row, things were found there and stayed, and it
    /// may be by chance that none was put there.
    fn taken(&self, row: &Row, rests: &[usize]) -> Vec<Vec<usize>> {
        let motion = self.motion;
        let left = |rest: usize| {
            let mut ends = motion.attempts.iter().filter_map(|attempt| motion.ends(attempt));
            ends.any(|(before, _)| before == rest)
        };
        let like = |rest: usize| -> Option<Vector3<f64>> {
            let own = &motion.rests[rest];
            let at = Vector3::from(self.pose(rest, row.frame)?.position);
            let mean = |i: usize| {
                row.places.iter().map(|place| place[i]).sum::<f64>() / row.places.len() as f64
            };
            let level = (0..3).all(|i| !row.agree[i] || (at[i] - mean(i)).abs() <= row.exact_m);
            let near = row.places.iter().map(|p| (p - at).norm()).fold(f64::MAX, f64::min);
            let goes_on = near >= PITCH.0 * row.pitch[0] && near <= PITCH.1 * row.pitch[1];
            let up = self.up?;
            let tilt = (own.pose.rotation() * row.upright)[up].clamp(-1.0, 1.0).acos();
            let stayed = own.came == Came::Found && !left(rest);
            (level && goes_on && stayed && tilt <= TILT_RAD).then_some(at)
        };
        let here: Option<Vec<(usize, Vector3<f64>)>> =
            rests.iter().map(|rest| like(*rest).map(|at| (*rest, at))).collect();
        let n = rests.len();
        let chance = so_many_found((n, n), (row.found + n, row.all + n));
        let Some(here) = here.filter(|_| chance > CHANCE_BOTH) else { return Vec::new() };
        let mut places: Vec<(Vector3<f64>, Vec<usize>)> = Vec::new();
        for (rest, at) in here {
            match places.iter_mut().find(|(place, _)| (*place - at).norm() <= row.pitch[0] / 2.0) {
                Some((_, own)) => own.push(rest),
                None => places.push((at, vec![rest])),
            }
        }
        places.into_iter().map(|(_, own)| own).collect()
    }
}
