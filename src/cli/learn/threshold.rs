//! The clustering threshold as typed: a length with or without a unit.

use crate::cli::end::BadArgument;

/// Units and their length in metres. The longest suffix comes first.
const UNITS: [(&str, f64); 5] =
    [("mm", 1e-3), ("cm", 1e-2), ("µm", 1e-6), ("um", 1e-6), ("m", 1.0)];

/// Greatest accepted number without a unit, in metres. A number meant in millimetres is greater.
const MOST_BARE_M: f64 = 0.1;

/// Reads a threshold in metres.
///
/// # Errors
/// [`BadArgument`] for anything but a length above 0, and for a number without a unit that is too great to be in
/// metres.
pub(super) fn metres(typed: &str) -> Result<f64, BadArgument> {
    let refused = || {
        BadArgument::range("--threshold", typed, "a length above 0, such as 1.169mm or 0.001169m")
    };
    let text = typed.trim();
    let unit = UNITS.iter().find(|(unit, _)| text.ends_with(unit));
    let (number, metres) = unit.map_or((text, 1.0), |(u, m)| (&text[..text.len() - u.len()], *m));
    let number: f64 = number.trim_end().parse().map_err(|_| refused())?;
    let length = number * metres;
    if !(length.is_finite() && length > 0.0) {
        return Err(refused());
    }
    if unit.is_none() && length > MOST_BARE_M {
        return Err(BadArgument(format!(
            "--threshold {typed}: a number without a unit is in metres, and {number} m is too much; \
             for millimetres write {number}mm, for metres {number}m"
        )));
    }
    Ok(length)
}
