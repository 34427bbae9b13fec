//! OFF meshes, with the broken headers of ModelNet.

use super::text::parse_point;
use super::{CloudFormat, FormatError};

/// A mesh: vertices `[n, 3]`, and triangles as indices of vertices.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Mesh {
    pub vertices: Vec<[f64; 3]>,
    pub triangles: Vec<[usize; 3]>,
}

/// OFF files; the vertices are the points.
pub(super) struct Off;

impl CloudFormat for Off {
    fn extensions(&self) -> &[&'static str] {
        &["off"]
    }

    fn read(&self, bytes: &[u8]) -> Result<Vec<[f64; 3]>, FormatError> {
        Ok(parse_mesh(bytes)?.vertices)
    }

    fn write(&self, points: &[[f64; 3]], out: &mut dyn std::io::Write) -> std::io::Result<()> {
        writeln!(out, "OFF\n{} 0 0", points.len())?;
        points.iter().try_for_each(|[x, y, z]| writeln!(out, "{x} {y} {z}"))
    }
}

/// Reads a text OFF file. Polygons become fans of triangles; colours and normals are passed over.
/// The counts may follow `OFF` on its own line with or without a space, as in some ModelNet files.
pub(crate) fn parse_mesh(bytes: &[u8]) -> Result<Mesh, FormatError> {
    let text = String::from_utf8_lossy(bytes);
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(number, line)| (number + 1, line.split('#').next().unwrap_or_default().trim()))
        .filter(|(_, line)| !line.is_empty());

    let (number, first) = lines.next().ok_or_else(|| FormatError::truncated("a header", "nothing"))?;
    let rest = ["OFF", "COFF", "NOFF", "CNOFF", "NCOFF"]
        .iter()
        .find_map(|magic| first.strip_prefix(magic))
        .ok_or_else(|| FormatError::Content("the file does not begin with OFF".into()))?;
    if rest.contains("BINARY") {
        return Err(FormatError::Content("binary OFF is not supported; save it as text".into()));
    }
    let (number, counts) = if rest.trim().is_empty() {
        lines.next().ok_or_else(|| FormatError::truncated("the counts", "nothing"))?
    } else {
        (number, rest.trim())
    };
    let counts: Vec<usize> = counts.split_whitespace().map_while(|field| field.parse().ok()).collect();
    let [vertices, faces, ..] = counts[..] else {
        return Err(FormatError::line(number, "the numbers of vertices and faces are expected"));
    };

    // The counts are not trusted with memory: a line takes 6 bytes or more.
    let mut mesh = Mesh::default();
    mesh.vertices.reserve(vertices.min(bytes.len() / 6));
    for (number, line) in lines.by_ref().take(vertices) {
        mesh.vertices.push(parse_point(line).map_err(|problem| FormatError::line(number, problem))?);
    }
    if mesh.vertices.len() < vertices {
        let found = mesh.vertices.len().to_string();
        return Err(FormatError::truncated(format!("{vertices} vertices"), found));
    }
    let mut found = 0;
    for (number, line) in lines.take(faces) {
        let problem = |text: &str| FormatError::line(number, text);
        let mut fields = line.split_whitespace().map(str::parse::<usize>);
        let Some(Ok(count)) = fields.next() else {
            return Err(problem("the number of corners of a face is expected"));
        };
        let corners: Vec<usize> = fields.take(count).map_while(Result::ok).collect();
        if corners.len() < count {
            return Err(problem("the face has fewer corners than it says"));
        }
        if corners.iter().any(|&corner| corner >= vertices) {
            return Err(problem("the face names a vertex that does not exist"));
        }
        for pair in corners.windows(2).skip(1) {
            mesh.triangles.push([corners[0], pair[0], pair[1]]);
        }
        found += 1;
    }
    if found < faces {
        return Err(FormatError::truncated(format!("{faces} faces"), found.to_string()));
    }
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BODY: &str = "0 0 0\n1 0 0 255 0 0\n1 1 0\n0 1 0.5\n\n4 0 1 2 3\n3 0 2 3 0.5 0.5 0.5\n";

    #[test]
    fn headers_of_all_kinds() {
        for head in ["OFF\n4 2 0\n", "OFF4 2 0\n", "OFF 4 2 0\r\n", "# made\nCOFF\n# counts\n4 2 5 # end\n"] {
            let mesh = parse_mesh(format!("{head}{BODY}").as_bytes()).unwrap();
            assert_eq!(mesh.vertices[3], [0.0, 1.0, 0.5], "{head:?}");
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 2, 3]]);
        }
    }

    #[test]
    fn damage_is_found() {
        let read = |text: &str| parse_mesh(text.as_bytes()).unwrap_err().to_string();
        assert!(read("PLY\n").contains("begin with OFF"));
        assert!(read("OFF\n3 x\n").contains("line 2"));
        assert!(read("OFF\n3 0 0\n0 0 0\n1 1\n").contains("line 4"));
        assert!(read("OFF\n999999999999 1 0\n0 0 0\n").contains("999999999999 vertices announced, 1 found"));
        assert!(read("OFF\n1 1 0\n0 0 0\n3 0 0 7\n").contains("does not exist"));
        assert!(read("OFF\n1 1 0\n0 0 0\n3 0 0\n").contains("fewer corners"));
        assert!(read("OFF\n1 2 0\n0 0 0\n3 0 0 0\n").contains("2 faces announced, 1 found"));
        assert!(read("").contains("nothing") && read("OFF").contains("nothing"));
    }
}
