//! The pairs that the page shows in 3D.

use srrf_cloud::Register;
use srrf_view::{Number, Pair as ViewPair, Pose, viewer_element};

use crate::EvalError;
use crate::answers::{PairRecord, RunOutcome};
use crate::pairs::{EvalPair, PairSource};
use crate::rows::TableRow;

/// The severity of the pairs shown.
const SEVERITY: u8 = 3;
/// Pairs on which the network did worst, beside a typical one of each corruption.
const WORST: usize = 3;
/// The row by whose error pairs are chosen.
const BY: TableRow = TableRow::SRRF;

/// A pair to show, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ChosenPair {
    record: usize,
    why: &'static str,
}

/// The viewer with a typical pair of each corruption and the worst ones: every method's pose with its
/// errors, and the skeletons of `skeletons`.
///
/// # Errors
/// [`EvalError`] where a pair cannot be made.
pub(crate) fn viewer(
    pairs: &dyn PairSource,
    outcome: &RunOutcome,
    skeletons: Option<&dyn Register>,
) -> Result<String, EvalError> {
    let choices = choose(outcome);
    let made: Vec<EvalPair> = choices
        .iter()
        .map(|c| pairs.pair(outcome.records[c.record].group, outcome.records[c.record].item))
        .collect::<Result<_, _>>()?;
    let shown: Vec<ViewPair<'_>> = choices
        .iter()
        .zip(&made)
        .map(|(choice, made)| view(outcome, &outcome.records[choice.record], choice.why, made, skeletons))
        .collect();
    Ok(if shown.is_empty() { String::new() } else { viewer_element("pairs-view", &shown) })
}

fn view<'a>(
    outcome: &RunOutcome,
    record: &PairRecord,
    why: &str,
    made: &'a EvalPair,
    skeletons: Option<&dyn Register>,
) -> ViewPair<'a> {
    let group = outcome.groups[record.group].name();
    let name = format!("{group}, {}{why}", record.id);
    let mut shown = ViewPair::new(name, &made.pair.source, &made.pair.target);
    // The first pose is shown first: the network's.
    let (ours, others): (Vec<usize>, Vec<usize>) =
        (0..outcome.rows.len()).partition(|&row| outcome.rows[row] == BY);
    for row in ours.into_iter().chain(others) {
        let answer = &record.answers[row];
        let Some(pose) = answer.pose else {
            shown = shown.warning(format!("{} found no pose.", outcome.rows[row]));
            continue;
        };
        shown = shown.pose(
            Pose::new(outcome.rows[row].to_string(), pose)
                .number(Number::new("Rotation error", answer.error.rotation_deg).unit("°"))
                .number(Number::new("Translation error", answer.error.translation_norm)),
        );
    }
    shown = shown.pose(Pose::new("truth", record.truth));
    let found = skeletons.and_then(|s| s.register(&made.pair.source, &made.pair.target).ok());
    match found.and_then(|f| f.skeletons) {
        Some(both) => shown.skeletons(both.source, both.target),
        None => shown,
    }
}

/// The pair of median error of each corruption at the middle severity (asymmetric shapes, where there
/// are some), and the worst pairs of all.
fn choose(outcome: &RunOutcome) -> Vec<ChosenPair> {
    let row = outcome.rows.iter().position(|r| *r == BY).unwrap_or(0);
    let error = |index: &usize| outcome.records[*index].answers[row].error.rotation_deg;
    let mut chosen: Vec<ChosenPair> = Vec::new();
    for (group, named) in outcome.groups.iter().enumerate() {
        if ![0, SEVERITY].contains(&named.severity) {
            continue;
        }
        let of_group: Vec<usize> =
            (0..outcome.records.len()).filter(|&i| outcome.records[i].group == group).collect();
        let asymmetric: Vec<usize> =
            of_group.iter().copied().filter(|&i| !outcome.records[i].symmetric).collect();
        let mut ranked = if asymmetric.is_empty() { of_group } else { asymmetric };
        ranked.sort_by(|a, b| error(a).total_cmp(&error(b)));
        chosen.extend(ranked.get(ranked.len() / 2).map(|&record| ChosenPair { record, why: "" }));
    }
    let mut all: Vec<usize> = (0..outcome.records.len()).collect();
    all.sort_by(|a, b| error(b).total_cmp(&error(a)));
    let worst =
        all.into_iter().filter(|&i| !outcome.records[i].symmetric && !chosen.iter().any(|c| c.record == i));
    let worst: Vec<ChosenPair> =
        worst.take(WORST).map(|record| ChosenPair { record, why: " (among the worst)" }).collect();
    chosen.extend(worst);
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::summary::tests::outcome;

    #[test]
    fn typical_pairs_of_the_middle_severity_then_the_worst() {
        let mut outcome = outcome();
        outcome.rows = vec![TableRow::ICP, TableRow::SRRF];
        let chosen = choose(&outcome);
        // Clean and cutout at 3, without the symmetric shape; then what is left and not symmetric.
        let records: Vec<(usize, usize)> = chosen
            .iter()
            .map(|c| (outcome.records[c.record].group, outcome.records[c.record].item))
            .collect();
        assert_eq!(records, [(0, 0), (2, 0), (1, 0)]);
        assert!(chosen[1].why.is_empty() && chosen[2].why.contains("worst"));
    }
}
