//! The paper's own numbers, to be put beside ours.

use std::sync::OnceLock;

use crate::metrics::Scores;
use crate::rows::TableRow;

/// The rows of the paper's tables 1 to 4 as they are printed.
const TEXT: &str = include_str!("../../data/paper.csv");

/// Table 5: the paper's Chamfer distance between skeletons without and with the distribution
/// distance loss, in a unit that it does not say.
pub(crate) const SKELETON_CHAMFER: [f64; 2] = [3.85, 1.83];

/// Methods of tables 1 to 3, as our rows, in the paper's order.
pub(crate) static METHODS: [TableRow; 7] = [
    TableRow::ICP,
    TableRow::method("pointnetlk"),
    TableRow::DCP,
    TableRow::RGM,
    TableRow::method("panet"),
    TableRow::method("equi-gspr"),
    TableRow::SRRF,
];

/// A row of one of the tables 1 to 4.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PaperRow {
    /// Number of the table.
    pub table: u8,
    /// Our name of the corruption; in table 4 the paper's name of the sampling.
    pub corruption: &'static str,
    /// Our row of the method.
    pub method: TableRow,
    /// MSE, RMSE and MAE of the rotation in degrees, then of the translation.
    pub values: [f64; 6],
}

/// All rows, in the paper's order.
pub(crate) fn rows() -> &'static [PaperRow] {
    static ROWS: OnceLock<Vec<PaperRow>> = OnceLock::new();
    ROWS.get_or_init(|| TEXT.lines().skip(1).filter_map(row).collect())
}

fn row(line: &'static str) -> Option<PaperRow> {
    let cells: Vec<&'static str> = line.split(',').collect();
    let (&[table, corruption, method], numbers) = cells.split_first_chunk::<3>()?;
    let numbers: Vec<f64> = numbers.iter().map(|n| n.parse().ok()).collect::<Option<_>>()?;
    let method = TableRow::method(method);
    Some(PaperRow { table: table.parse().ok()?, corruption, method, values: numbers.try_into().ok()? })
}

/// The paper's numbers for a corruption and a method, if it has them.
pub(crate) fn find(corruption: &str, method: &TableRow) -> Option<&'static PaperRow> {
    rows().iter().find(|r| r.corruption == corruption && r.method == *method)
}

/// Our values in the order of [`PaperRow::values`].
pub(crate) fn values(scores: &Scores) -> [f64; 6] {
    [scores.mse_r, scores.rmse_r, scores.mae_r, scores.mse_t, scores.rmse_t, scores.mae_t]
}

#[cfg(test)]
mod tests {
    use srrf_corrupt::CorruptionKind;

    use super::*;

    #[test]
    fn every_row_is_there() {
        assert_eq!(rows().len(), TEXT.lines().count() - 1);
        for kind in CorruptionKind::ALL {
            // The paper defines upsampling and has no numbers for it.
            let expected = if kind == CorruptionKind::Upsampling { 0 } else { METHODS.len() };
            let found = METHODS.iter().filter(|m| find(kind.name(), m).is_some()).count();
            assert_eq!(found, expected, "{kind}");
        }
        assert_eq!(rows().iter().filter(|r| r.table == 4).count(), 4);
    }

    /// A wrong digit would break it: the paper's RMSE is the root of its MSE, save in one cell, where
    /// the paper itself is wrong.
    #[test]
    fn the_transcription_agrees_with_itself() {
        for row in rows() {
            for (at, slack) in [(0, 2e-6), (3, 1e-3)] {
                let (mse, rmse) = (row.values[at], row.values[at + 1]);
                let wrong_in_the_paper =
                    row.corruption == "gaussian" && row.method == TableRow::ICP && at == 3;
                assert_eq!((mse.sqrt() - rmse).abs() > slack, wrong_in_the_paper, "{row:?}");
            }
        }
        let above =
            |at: usize| rows().iter().filter(move |r| r.table < 4 && r.values[at + 2] > r.values[at + 1]);
        assert_eq!((above(0).count(), above(3).count()), (33, 9), "MAE above RMSE");
    }
}
