//! Sums and products of vectors of three numbers.

/// `a + b`.
pub fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] + b[i])
}

/// `a - b`.
pub fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] - b[i])
}

/// `a` times a number.
pub fn scale(a: [f64; 3], by: f64) -> [f64; 3] {
    a.map(|v| v * by)
}

/// The cross product.
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}

/// The same direction with length 1; not finite for a vector without length.
pub fn unit(a: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = a;
    // Multiplied rather than divided, as the physics does it: the last bit differs.
    scale(a, 1.0 / (x * x + y * y + z * z).sqrt())
}
