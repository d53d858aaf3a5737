//! The line colours of all pages can be told apart by the colour-blind: for each deficiency as simulated by Machado,
//! Oliveira and Fernandes (2009, severity 1), no two are closer than 10 in CIELAB.

const THEME: &str = include_str!("../../assets/report/theme.js");
const SEEN: [[[f64; 3]; 3]; 4] = [
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
];

fn times(matrix: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    matrix.map(|row| (0..3).map(|i| row[i] * v[i]).sum())
}

/// The colour `#rrggbb` in CIELAB, as it is seen.
fn lab(colour: &str, seen: &[[f64; 3]; 3]) -> [f64; 3] {
    let linear = [1, 3, 5].map(|at| {
        let v = f64::from(u8::from_str_radix(&colour[at..at + 2], 16).unwrap()) / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    });
    let seen = times(seen, linear).map(|v| v.clamp(0.0, 1.0));
    let to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]];
    let [x, y, z] = times(&to_xyz, seen);
    let [x, y, z] = [x / 0.9505, y, z / 1.089]
        .map(|t: f64| if t > 0.008856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The least distance of two colours, of all kinds of eyes.
fn least(colours: &[&str]) -> f64 {
    let mut least = f64::INFINITY;
    for seen in &SEEN {
        let all: Vec<[f64; 3]> = colours.iter().map(|colour| lab(colour, seen)).collect();
        for (i, a) in all.iter().enumerate() {
            for b in &all[..i] {
                let apart = (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt();
                least = least.min(apart);
            }
        }
    }
    least
}

#[test]
fn the_colour_blind_tell_all_lines_apart() {
    let lines = THEME.lines().filter(|line| line.contains("light: [") || line.contains("dark: ["));
    let palettes: Vec<Vec<&str>> =
        lines.map(|line| line.split('"').filter(|part| part.starts_with('#')).collect()).collect();
    assert_eq!(palettes.iter().map(Vec::len).collect::<Vec<_>>(), [7, 7]);
    for palette in &palettes {
        assert!(least(palette) > 10.0, "{palette:?}: {}", least(palette));
    }
    // To those without green cones these two are nearly one colour.
    assert!(least(&["#d55e00", "#b8860b"]) < 5.0);
}
