//! The table of an experiment.

use anyhow::Error;
use symbolt::study::experiment::{Results, Row};
use symbolt::study::statistics::{FEW_TRIALS, Statistic};

use crate::cli::end::Outcome;
use crate::cli::options::Seedless;
use crate::cli::output::answer;
use crate::cli::table::{Grid, wrapped};

/// Prints the table of an experiment.
pub(crate) fn show(common: &Seedless, results: &Results) -> Result<Outcome, Error> {
    answer(
        common,
        || results.to_json(),
        || format!("{}\n\n{}", wrapped(results.question, 0), tables(results)),
    )
}

/// The headings of the columns that every experiment has.
const STATISTICS: [&str; 4] = [">value", ">95% interval", ">SD", ">trials"];

/// Returns the table of an experiment. If the terminal is too narrow for it, the settings on its left become headings
/// of several narrower tables.
fn tables(results: &Results) -> String {
    let columns = results.columns();
    let few = results.rows.iter().filter(|row| row.statistic.is_of_few_trials()).count();
    let mark = few > 0 && few < results.rows.len();
    let rows: Vec<Vec<String>> =
        results.rows.iter().map(|row| cells(row, &columns, mark)).collect();
    let heads: Vec<&str> = columns.iter().copied().chain(STATISTICS).collect();
    let table = |rows: &[Vec<String>], from: usize| {
        let mut grid = Grid::new(&heads[from..]);
        rows.iter().for_each(|row| grid.row(row[from..].iter().cloned()));
        grid
    };
    let most = columns.len().saturating_sub(1);
    let cut = (0..most).find(|from| table(&rows, *from).fits()).unwrap_or(most);
    let mut text = String::new();
    for group in rows.chunk_by(|a, b| a[..cut] == b[..cut]) {
        if cut > 0 {
            let settings = columns.iter().zip(&group[0][..cut]).filter(|(_, v)| !v.is_empty());
            let settings: Vec<String> = settings.map(|(name, v)| format!("{name} = {v}")).collect();
            let gap = if text.is_empty() { "" } else { "\n" };
            text += &format!("{gap}{}\n\n", wrapped(&settings.join(", "), 0));
        }
        text += &table(group, cut).to_string();
    }
    if few > 0 {
        let which = if mark { "* Intervals from" } else { "All intervals are from" };
        let warning = format!(
            "{which} fewer than {FEW_TRIALS} independent trials. Take them as a rough guide: so few trials hardly \
             show how much the results vary."
        );
        text += &format!("\n{}\n", wrapped(&warning, 0));
    }
    text
}

/// Returns the cells of a row: its settings, then its statistic. With `mark`, an asterisk marks few trials.
fn cells(row: &Row, columns: &[&str], mark: bool) -> Vec<String> {
    let [low, high] = row.statistic.interval95();
    let (value, interval) = match row.statistic {
        Statistic::Rate(rate) => (
            format!("{:.2} %", 100.0 * rate.share()),
            format!("{:.2} to {:.2}", 100.0 * low, 100.0 * high),
        ),
        Statistic::Mean(mean) => {
            let known = mean.half95.is_finite();
            let interval = || format!("{low:.4} to {high:.4}");
            (format!("{:.4}", mean.mean), if known { interval() } else { "-".into() })
        }
    };
    let sd = row.statistic.sd().filter(|sd| sd.is_finite());
    let sd = sd.map_or_else(String::new, |sd| format!("{sd:.4}"));
    let all = row.statistic.trials();
    // Correlated trials count as fewer.
    let trials = match row.statistic.effective_trials() {
        Some(effective) if effective < 0.95 => format!("{all} (as less than 1)"),
        Some(effective) if effective.round() < all as f64 => {
            format!("{all} (as {effective:.0})")
        }
        _ => all.to_string(),
    };
    let few = if mark && row.statistic.is_of_few_trials() { " *" } else { "" };
    let end = [value, interval, sd, format!("{trials}{few}")];
    columns.iter().map(|key| row.text(key).into_owned()).chain(end).collect()
}

#[cfg(test)]
mod tests {
    use serde_json::json;
    use symbolt::study::statistics::{Mean, Rate};

    use super::*;

    #[test]
    fn rows_of_few_trials_are_marked_and_words_are_kept_whole() {
        let row = |what: &str, statistic| {
            let settings = json!({"a_long_name_of_a_setting": 0.25, "what": what});
            Row { settings: settings.as_object().cloned().unwrap_or_default(), statistic }
        };
        let long = "share of pairs within below those between and_a_word_of_20_char";
        let rows = vec![
            row(long, Statistic::Rate(Rate::new(3, 4))),
            row("mean", Statistic::Mean(Mean::of((0..12).map(f64::from)))),
        ];
        let results = Results { name: "a", question: "b?", settings: json!({}), rows };
        let text = tables(&results);
        assert!(text.starts_with("a_long_name_of_a_setting = 0.25\n\n| what"), "{text}");
        assert!(text.contains("4 * |") && text.contains(" 12 |"), "{text}");
        assert!(text.contains("\n* Intervals from fewer than 10 independent trials."), "{text}");
        assert!(text.contains("| and_a_word_of_20_char "), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
    }
}
