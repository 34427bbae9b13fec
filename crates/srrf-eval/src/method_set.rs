//! [`MethodSet`]: the methods of a run, the rows that they fill, and what is left out.

use std::collections::BTreeMap;

use crate::EvalError;
use crate::methods::{MethodContext, ReadyMethod, SetupError, Shown, all_rows, entry_of, registry};
use crate::rows::{RowSource, TableRow};
use crate::transforms::Transforms;

/// Methods that are ready to run, and the rows of the tables.
#[derive(Default)]
pub struct MethodSet {
    /// The methods.
    pub methods: Vec<ReadyMethod>,
    /// Rows, in the order of the tables.
    pub rows: Vec<TableRow>,
    /// Rows that are left out, and why.
    pub left_out: Vec<(String, String)>,
}

/// Which rows are taken when none is named.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DefaultRows {
    /// Those of the plain run.
    Plain,
    /// Those of `srrf-eval tables`.
    Tables,
}

impl DefaultRows {
    fn has(self, row: &TableRow) -> bool {
        let shown = entry_of(row).map_or(Shown::Everywhere, |entry| entry.shown);
        match self {
            Self::Plain => shown == Shown::Everywhere,
            Self::Tables => shown != Shown::OnRequest,
        }
    }
}

impl MethodSet {
    /// Sets up what the rows of these names need; the default rows where `names` is empty. Of these, methods that nobody has
    /// trained are left out.
    ///
    /// # Errors
    /// [`EvalError::Method`] for a name that is no row, [`EvalError::Setup`] for a method that cannot be set up.
    pub fn new(names: &[String], defaults: DefaultRows, context: &MethodContext) -> Result<Self, EvalError> {
        let known = all_rows();
        let named = |name: &String| known.iter().find(|row| row.to_string() == *name).cloned();
        let wanted: Vec<TableRow> = if names.is_empty() {
            known.iter().filter(|row| defaults.has(row)).cloned().collect()
        } else {
            let unknown = |name: &String| EvalError::Method {
                name: name.clone(),
                known: known.iter().map(TableRow::to_string).collect::<Vec<_>>().join(", "),
            };
            names.iter().map(|name| named(name).ok_or_else(|| unknown(name))).collect::<Result<_, _>>()?
        };
        Self::of_rows(&wanted, names.is_empty(), context)
    }

    /// Sets up what these rows need; where they are a choice of ours, methods that nobody has trained are left out.
    ///
    /// # Errors
    /// [`EvalError::Setup`] for a method that cannot be set up.
    pub(crate) fn of_rows(
        wanted: &[TableRow],
        may_leave_out: bool,
        context: &MethodContext,
    ) -> Result<Self, EvalError> {
        let mut set = Self::default();
        for entry in registry().iter().filter(|entry| entry.rows().iter().any(|row| wanted.contains(row))) {
            match entry.set_up(context) {
                Ok(method) => set.methods.push(method),
                Err(problem @ SetupError::Untrained { .. }) if may_leave_out => {
                    set.left_out.push((entry.name.to_owned(), problem.to_string()));
                }
                Err(source) => return Err(EvalError::Setup { name: entry.name, source: Box::new(source) }),
            }
        }
        let filled = |row: &TableRow| *row == TableRow::Oracle || set.method(row).is_some();
        set.rows = all_rows().into_iter().filter(|row| wanted.contains(row) && filled(row)).collect();
        Ok(set)
    }

    /// Adds a method of your own, with a row for it (and its branches) after the others.
    #[must_use]
    pub fn with(mut self, method: ReadyMethod) -> Self {
        self.rows.extend(method.rows());
        self.methods.push(method);
        self
    }

    /// Without the methods of which nothing is wanted but what another one answers on its way.
    #[must_use]
    pub fn without_held(mut self) -> Self {
        let held: Vec<TableRow> =
            self.methods.iter().flat_map(|m| m.holds).map(|(row, _)| row.clone()).collect();
        self.methods.retain(|method| !method.rows().iter().all(|row| held.contains(row)));
        self
    }

    /// Adds a row for each file of transforms.
    ///
    /// # Errors
    /// [`EvalError::Usage`] where the name of a file is that of a row already.
    pub fn add_transforms(&mut self, transforms: &[Transforms]) -> Result<(), EvalError> {
        for file in transforms {
            if all_rows().iter().chain(&self.rows).any(|row| row.to_string() == file.name) {
                return Err(EvalError::Usage(format!(
                    "--transforms: the row `{}` exists already; the row is named after the file, so rename the \
                     file",
                    file.name
                )));
            }
            self.rows.push(TableRow::File(file.name.clone()));
        }
        Ok(())
    }

    /// Leaves out the oracle, for pairs without correspondences.
    ///
    /// # Errors
    /// [`EvalError::Usage`] where it was `asked` for by name.
    pub fn drop_oracle(&mut self, asked: bool) -> Result<(), EvalError> {
        if asked && self.rows.contains(&TableRow::Oracle) {
            return Err(EvalError::Usage(
                "--methods oracle: these pairs keep no correspondences; use --sampling shared, or pairs \
                 exported by this program"
                    .into(),
            ));
        }
        self.rows.retain(|row| *row != TableRow::Oracle);
        Ok(())
    }

    /// The rows among `wanted`, in the order of the tables.
    pub(crate) fn only(&self, wanted: &[TableRow]) -> Vec<TableRow> {
        self.rows.iter().filter(|row| wanted.contains(row)).cloned().collect()
    }

    /// The method that fills a row.
    pub fn method(&self, row: &TableRow) -> Option<&ReadyMethod> {
        self.methods.iter().find(|method| method.rows().contains(row))
    }

    /// Where the weights of each method that learns come from, by its name.
    pub fn weights(&self) -> BTreeMap<String, String> {
        let named = |m: &ReadyMethod| Some((m.register.name().to_owned(), m.weights.clone()?));
        self.methods.iter().filter_map(named).collect()
    }
}

/// What fills a row; `None` where nothing does. A method's own row before one that another method answers on its way.
pub(crate) fn source_of(
    row: &TableRow,
    methods: &[ReadyMethod],
    transforms: &[Transforms],
) -> Option<RowSource> {
    match row {
        TableRow::Oracle => return Some(RowSource::Oracle),
        TableRow::File(name) => return transforms.iter().position(|t| t.name == *name).map(RowSource::File),
        TableRow::Method(_) | TableRow::Branch(..) => {}
    }
    let own = || {
        methods.iter().enumerate().find_map(|(method, m)| {
            let place = m.rows().iter().position(|own| own == row)?;
            Some(RowSource::Answer { method, branch: m.branches.get(place).copied(), own: true })
        })
    };
    let held = || {
        methods.iter().enumerate().find_map(|(method, m)| {
            let (_, branch) = m.holds.iter().find(|(held, _)| held == row)?;
            Some(RowSource::Answer { method, branch: Some(branch), own: false })
        })
    };
    own().or_else(held)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(names: &[&str], defaults: DefaultRows) -> Result<MethodSet, EvalError> {
        let names: Vec<String> = names.iter().map(|n| (*n).to_owned()).collect();
        MethodSet::new(&names, defaults, &MethodContext::of_srrf(None, "flex"))
    }

    #[test]
    fn rows_are_chosen_by_name_and_kept_in_order() {
        let chosen = set(&["oracle", "identity"], DefaultRows::Plain).unwrap();
        assert_eq!(chosen.rows, [TableRow::IDENTITY, TableRow::Oracle]);
        assert_eq!(chosen.methods.len(), 1);
        let error = set(&["icp", "magic"], DefaultRows::Plain).err().unwrap().to_string();
        assert!(error.contains("`magic`") && error.contains("identity, icp"), "{error}");
    }

    #[test]
    fn default_rows() {
        let plain = set(&[], DefaultRows::Plain).unwrap();
        assert_eq!(plain.rows[..3], [TableRow::IDENTITY, TableRow::ICP, TableRow::Oracle]);
        let tables = set(&[], DefaultRows::Tables).unwrap();
        assert!(plain.rows.iter().all(|row| tables.rows.contains(row)));
        assert!(tables.rows.contains(&TableRow::RGM) && tables.rows.contains(&TableRow::SRRF_REFINE));
        assert!(!tables.rows.contains(&TableRow::method("icp-centred")));
        assert!(tables.left_out.is_empty(), "every learned baseline is trained");
        assert!(tables.weights()["srrf"].starts_with("srrf "));
    }

    #[test]
    fn a_method_that_answers_anothers_rows_runs_in_its_place() {
        let running = |names: &[&str]| -> Vec<String> {
            let set = set(names, DefaultRows::Plain).unwrap().without_held();
            set.methods.iter().map(|method| method.register.name().to_owned()).collect()
        };
        assert_eq!(running(&["srrf-dense", "srrf", "srrf+refine"]), ["srrf+refine"]);
        assert_eq!(running(&["icp", "srrf-dense"]), ["icp", "srrf"]);
    }

    #[test]
    fn sources_are_the_methods_own_answers_first() {
        let both = set(&["srrf", "srrf-dense", "srrf+refine", "icp"], DefaultRows::Plain).unwrap();
        let source = |row: &TableRow| source_of(row, &both.methods, &[]);
        let answer = |method, branch, own| Some(RowSource::Answer { method, branch, own });
        assert_eq!(source(&TableRow::SRRF), answer(1, None, true));
        assert_eq!(source(&TableRow::SRRF_DENSE), answer(1, Some("dense"), true));
        let refined = both.without_held();
        let source = |row: &TableRow| source_of(row, &refined.methods, &[]);
        assert_eq!(source(&TableRow::SRRF), answer(1, Some("unrefined"), false));
        assert_eq!(source(&TableRow::SRRF_REFINE), answer(1, None, true));
        assert_eq!(source(&TableRow::Oracle), Some(RowSource::Oracle));
        assert_eq!((source(&TableRow::DCP), source(&TableRow::File("tool".into()))), (None, None));
    }
}
