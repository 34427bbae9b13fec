//! The list of pairs of a batch: a CSV file.

use std::path::{Path, PathBuf};

use csv_core::ReadFieldResult;

use srrf_args::Failure;

/// One line of the list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ListedPair {
    /// Its number, from 1; the line of the names does not count.
    pub number: usize,
    /// The source as written.
    pub source: String,
    /// The target as written.
    pub target: String,
    /// The file of the first guess as written, if there is one.
    pub initial: Option<String>,
}

/// The pairs of a batch.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PairList {
    /// In the order of the file.
    pub rows: Vec<ListedPair>,
    folder: PathBuf,
}

impl PairList {
    /// Reads the list. Its first line names the columns: `source`, `target` and, if wanted, `initial`;
    /// others are passed over.
    ///
    /// # Errors
    /// [`Failure::usage`], which names the file and the line.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let bytes = std::fs::read(path).map_err(|e| {
            Failure::usage(format!("cannot read {path:?}: {e}; it should be a CSV list of pairs"))
        })?;
        let rows = parse(&bytes).map_err(|problem| Failure::usage(format!("{path:?}: {problem}")))?;
        Ok(Self { rows, folder: path.parent().map(Path::to_owned).unwrap_or_default() })
    }

    /// The path of a file that is written relative to the list.
    pub fn path(&self, written: &str) -> PathBuf {
        self.folder.join(written)
    }
}

fn parse(bytes: &[u8]) -> Result<Vec<ListedPair>, String> {
    // Spreadsheets begin their files with a byte order mark.
    let mut records = records(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))?.into_iter();
    let (_, names) = records.next().ok_or("it is empty; its first line should be `source,target`")?;
    let column = |name: &str| names.iter().position(|n| n.eq_ignore_ascii_case(name));
    let (Some(source), Some(target)) = (column("source"), column("target")) else {
        return Err(format!(
            "its first line names the columns {names:?}; name them `source` and `target`, and `initial` if there are \
             first guesses"
        ));
    };
    let initial = column("initial");
    let mut rows = Vec::new();
    for (number, (line, fields)) in (1..).zip(records) {
        if fields.len() != names.len() {
            return Err(format!(
                "line {line}: {} fields, where the first line has {}; put names with commas in quotes",
                fields.len(),
                names.len()
            ));
        }
        let row = ListedPair {
            number,
            source: fields[source].clone(),
            target: fields[target].clone(),
            initial: initial.map(|index| fields[index].clone()).filter(|name| !name.is_empty()),
        };
        if row.source.is_empty() || row.target.is_empty() {
            return Err(format!("line {line}: the source or the target is empty; name a file for each"));
        }
        if row.source == "-" || row.target == "-" {
            return Err(format!("line {line}: a list cannot read standard input; name files"));
        }
        rows.push(row);
    }
    if rows.is_empty() { Err("it lists no pairs".into()) } else { Ok(rows) }
}

/// The fields of each record, trimmed, with the line that it begins on.
fn records(mut bytes: &[u8]) -> Result<Vec<(u64, Vec<String>)>, String> {
    let mut reader = csv_core::Reader::new();
    let (mut found, mut fields, mut field) = (Vec::new(), Vec::new(), Vec::new());
    let mut buffer = [0; 1024];
    let mut line = reader.line();
    loop {
        let (result, read, written) = reader.read_field(bytes, &mut buffer);
        bytes = &bytes[read..];
        field.extend_from_slice(&buffer[..written]);
        match result {
            // At the end of the bytes, an empty slice tells the reader so.
            ReadFieldResult::InputEmpty | ReadFieldResult::OutputFull => {}
            ReadFieldResult::Field { record_end } => {
                let text = std::str::from_utf8(&field)
                    .map_err(|_| format!("line {line}: not UTF-8; save the list as CSV in UTF-8"))?;
                fields.push(text.trim().to_owned());
                field.clear();
                if record_end {
                    found.push((line, std::mem::take(&mut fields)));
                    line = reader.line();
                }
            }
            ReadFieldResult::End => return Ok(found),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_by_name() {
        let text =
            "\u{feff}Target, note ,source,initial\r\nb.ply,\"x, y\",\"a 1.ply\",\r\nd.ply,,c.ply,i.txt\r\n";
        let rows = parse(text.as_bytes()).unwrap();
        assert_eq!(rows.len(), 2);
        assert_eq!((rows[0].source.as_str(), rows[0].target.as_str()), ("a 1.ply", "b.ply"));
        assert_eq!((rows[0].initial.as_deref(), rows[1].initial.as_deref()), (None, Some("i.txt")));
        assert_eq!(rows[1].number, 2);
    }

    #[test]
    fn errors_say_where() {
        let error = |text: &str| parse(text.as_bytes()).unwrap_err();
        assert!(error("a.ply,b.ply\n").contains("`source` and `target`"));
        assert!(error("source,target\n").contains("no pairs"));
        assert!(error("source,target\na,b\n,c\n").starts_with("line 3"));
        assert!(error("source,target\n-,c\n").contains("standard input"));
        assert!(error("source,target\na,b,c\n").starts_with("line 2: 3 fields"));
        assert!(error("").contains("empty"));
    }
}
