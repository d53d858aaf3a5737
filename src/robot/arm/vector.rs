//! Sums and products of vectors of three numbers.

/// Returns `a + b`.
pub fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + b[i])
}

/// Returns `a - b`.
pub fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

/// Returns `a` multiplied by a number.
pub fn scale(a: [f64; 3], by: f64) -> [f64; 3] {
    a.map(|v| v * by)
}

/// Returns the cross product of `a` and `b`.
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}

/// Returns the vector of length 1 in the same direction. The result is not finite if `a` has length 0.
pub fn unit(a: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = a;
    // Multiply by the reciprocal, as the physics does: a division differs in the last bit.
    scale(a, 1.0 / (x * x + y * y + z * z).sqrt())
}
