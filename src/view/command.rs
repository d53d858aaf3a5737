//! What a window may ask for: a closed set of commands, as JSON with one key each.

use serde::Deserialize;
use serde_json::Value;

use crate::sim::Intervention;

/// Greatest length of a message from a window, in bytes.
pub(super) const MOST_BYTES: usize = 65_536;
/// Greatest number of ticks of one step, forwards or back.
pub(super) const MOST_TICKS: u64 = 10_000_000;
/// Greatest number of values or neurons of one plot, and of expressions.
pub(super) const MOST_ROWS: [usize; 2] = [64, 256];
/// Greatest number of bytes of an expression.
const MOST_TEXT: usize = 1_000;
/// The slowest and the fastest speed, in simulated seconds a second.
const SPEEDS: [f64; 2] = [0.01, 1_000.0];

/// A command. In JSON it is an object with one key, such as `{"step":{"ticks":10}}`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub(super) enum Command {
    /// Stops between two ticks.
    Pause {},
    /// Goes on, at a speed in simulated seconds a second; without one as fast as it goes.
    Run {
        #[serde(default)]
        speed: Option<f64>,
    },
    /// Goes on for some ticks, then stops.
    Step { ticks: u64 },
    /// Goes on until the next event, such as a decision, then stops.
    Until {},
    /// Goes back by some ticks, and stops.
    Back { ticks: u64 },
    /// Goes to the end of a tick, and stops.
    Seek { tick: u64 },
    /// Adds a plot. The answer has its number, and `key`, by which the window knows what was asked.
    Plot { key: u32, what: Plotted },
    /// Removes a plot of the same window.
    Unplot { id: u32 },
    /// Makes an intervention.
    Do(Intervention),
    /// Sets a source, or clamps an output, to a pointer expression.
    Point { output: String, to: String, how: How },
    /// Forgets the interventions that lie ahead after going back.
    Forget {},
    /// Returns to the end of a branch; the run that is left is kept in its place.
    Branch { id: u32 },
    /// Asks for the whole log.
    Log {},
    /// Ends the live run.
    End {},
}

/// How an output gets the value of an expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum How {
    Set,
    Clamp,
}

/// What a plot shows.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub(super) enum Plotted {
    /// Values of an output, from the index `from`.
    Values {
        output: String,
        #[serde(default)]
        from: usize,
        count: usize,
    },
    /// Similarities of an output to pointer expressions.
    Similar { output: String, to: Vec<String> },
    /// A reading that the program offers, by its name.
    Reading { name: String },
    /// Spikes of some neurons of a layer, from the index `from`.
    Spikes {
        layer: String,
        #[serde(default)]
        from: usize,
        count: usize,
    },
}

impl Command {
    /// Reads a command and checks the ranges of its numbers. The error is a sentence.
    pub fn parse(text: &str) -> Result<Self, String> {
        let command: Self = serde_json::from_str(text).map_err(|error| {
            let number = serde_json::from_str(text).ok().and_then(|value| wrong_number("", &value));
            number.unwrap_or_else(|| {
                crate::sim::plain(&error.to_string()).chars().take(300).collect::<String>()
            })
        })?;
        command.check()?;
        Ok(command)
    }

    /// Returns whether it changes the run or where it stands. A window that may only watch cannot send it.
    pub fn touches(&self) -> bool {
        !matches!(self, Self::Plot { .. } | Self::Unplot { .. } | Self::Log {})
    }

    fn check(&self) -> Result<(), String> {
        let within = |name: &str, value: usize, most: usize| match (1..=most).contains(&value) {
            true => Ok(()),
            false => Err(format!("{name} is {value}; expected 1 to {most}")),
        };
        let text = |name: &str, value: &str| match value.len() <= MOST_TEXT {
            true => Ok(()),
            false => Err(format!("{name} has {} bytes; expected at most {MOST_TEXT}", value.len())),
        };
        let [least, most] = SPEEDS;
        match self {
            Self::Run { speed: Some(speed) } if !(least..=most).contains(speed) => {
                Err(format!("speed is {speed}; expected {least} to {most}, or none"))
            }
            Self::Step { ticks } | Self::Back { ticks } if !(1..=MOST_TICKS).contains(ticks) => {
                Err(format!("ticks is {ticks}; expected 1 to {MOST_TICKS}"))
            }
            Self::Point { to, .. } => text("to", to),
            Self::Plot { what, .. } => match what {
                Plotted::Values { count, .. } => within("count", *count, MOST_ROWS[0]),
                Plotted::Similar { to, .. } => {
                    within("the number of expressions", to.len(), MOST_ROWS[0])?;
                    to.iter().try_for_each(|to| text("an expression", to))
                }
                Plotted::Spikes { count, .. } => within("count", *count, MOST_ROWS[1]),
                Plotted::Reading { .. } => Ok(()),
            },
            _ => Ok(()),
        }
    }
}

/// Returns the key of a plot that is asked for, however wrong the rest is.
pub(super) fn plot_key(text: &str) -> Option<u32> {
    let value: Value = serde_json::from_str(text).ok()?;
    u32::try_from(value.get("plot")?.get("key")?.as_u64()?).ok()
}

/// Says which number is not a whole one of its range. `parent` is the key of the object.
fn wrong_number(parent: &str, value: &Value) -> Option<String> {
    value.as_object()?.iter().find_map(|(name, value)| {
        let [least, most] = match &**name {
            "ticks" => [1, MOST_TICKS],
            "count" => [1, MOST_ROWS[usize::from(parent == "spikes")] as u64],
            "key" | "id" => [0, u64::from(u32::MAX)],
            "tick" | "from" => [0, u64::MAX],
            _ => return wrong_number(name, value),
        };
        let right = value.as_u64().is_some_and(|value| (least..=most).contains(&value));
        (value.is_number() && !right)
            .then(|| format!("{name} is {value}; expected a whole number from {least} to {most}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_a_closed_set_and_their_numbers_have_ranges() {
        let right = [
            r#"{"pause":{}}"#,
            r#"{"run":{}}"#,
            r#"{"run":{"speed":0.01}}"#,
            r#"{"do":{"silence":{"at":"memory"}}}"#,
            r#"{"plot":{"key":1,"what":{"similar":{"output":"a.out","to":["NUT"]}}}}"#,
            r#"{"point":{"output":"a.out","to":"NUT","how":"set"}}"#,
        ];
        right.iter().for_each(|text| drop(Command::parse(text).expect(text)));
        let wrong = [
            ("", "EOF"),
            ("[]", "expected"),
            (r#"{"eval":{"code":"1"}}"#, "unknown variant `eval`"),
            (r#"{"pause":{"now":1}}"#, "unknown field"),
            (r#"{"run":{"speed":0.001}}"#, "expected 0.01 to 1000"),
            (r#"{"run":{"speed":1e999}}"#, "number out of range"),
            (r#"{"step":{"ticks":0}}"#, "expected 1 to 10000000"),
            (r#"{"step":{"ticks":-1}}"#, "ticks is -1; expected a whole number from 1 to 10000000"),
            (
                r#"{"plot":{"key":1,"what":{"values":{"output":"a","count":-1}}}}"#,
                "count is -1; expected a whole number from 1 to 64",
            ),
            (
                r#"{"plot":{"key":1,"what":{"values":{"output":"a","count":65}}}}"#,
                "expected 1 to 64",
            ),
            (
                r#"{"plot":{"key":1,"what":{"spikes":{"layer":"a","count":257}}}}"#,
                "expected 1 to 256",
            ),
            (r#"{"plot":{"key":1,"what":{"similar":{"output":"a","to":[]}}}}"#, "expected 1 to 64"),
        ];
        for (text, reason) in wrong {
            let said = Command::parse(text).expect_err(text);
            assert!(said.contains(reason), "{text}: {said}");
        }
        let long =
            format!(r#"{{"point":{{"output":"a","to":"{}","how":"set"}}}}"#, "A".repeat(1_001));
        assert!(Command::parse(&long).is_err_and(|said| said.contains("at most 1000")));
        let watching = Command::parse(r#"{"log":{}}"#).expect("a command");
        assert!(!watching.touches() && Command::Pause {}.touches());
    }
}
