//! The points and triangles of the scene in a glTF file, each mesh placed as its nodes say.

use std::collections::BTreeMap;

use gltf::json::Index;
use gltf::json::accessor::Accessor;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use nalgebra::{Matrix3, Matrix4, Quaternion, UnitQuaternion, Vector3};

use super::super::{FormatError, ReadOptions};
use super::accessor::AccessorNumbers;
use super::document::{GltfDocument, Placed};

/// What the scene holds.
#[derive(Debug, Default)]
pub(super) struct GltfScene {
    pub points: Vec<[f64; 3]>,
    pub faces: Vec<[u32; 3]>,
    pub single: bool,
    /// Points of primitives without triangles.
    pub loose: usize,
    /// `[x, y, z]` of each point, if all have them.
    pub normals: Option<Vec<[f64; 3]>>,
    /// Red, green, blue and alpha from 0 to 1, if all have them.
    pub colours: Option<Vec<[f64; 4]>>,
}

fn content(problem: impl Into<String>) -> FormatError {
    FormatError::Content(problem.into())
}

impl Placed {
    /// Maps the node into its parent.
    fn parent_from_node(&self) -> Matrix4<f64> {
        if let Some(matrix) = &self.matrix {
            return Matrix4::from_column_slice(matrix);
        }
        let [x, y, z, w] = self.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_rotation_matrix();
        let scale = Vector3::from(self.scale.unwrap_or([1.0; 3]));
        let linear = rotation.into_inner() * Matrix3::from_diagonal(&scale);
        let mut matrix = linear.to_homogeneous();
        let translation = Vector3::from(self.translation.unwrap_or_default());
        matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&translation);
        matrix
    }
}

impl GltfDocument<'_> {
    /// The nodes that are placed in the file itself: those of the scene that is shown, or where there is none those
    /// that are nobody's child.
    pub fn top_nodes(&self) -> Result<Vec<usize>, FormatError> {
        let chosen = self.root.scene.map_or(0, |index| index.value());
        if let Some(scene) = self.root.scenes.get(chosen) {
            return Ok(scene.nodes.iter().map(|node| node.value()).collect());
        }
        if self.root.scene.is_some() {
            return Err(content(format!("there is no scene {chosen}")));
        }
        let mut is_child = vec![false; self.root.nodes.len()];
        for child in self.root.nodes.iter().flat_map(|node| node.children.iter().flatten()) {
            if let Some(slot) = is_child.get_mut(child.value()) {
                *slot = true;
            }
        }
        Ok((0..is_child.len()).filter(|&node| !is_child[node]).collect())
    }

    /// Reads the scene.
    pub fn scene(&self, held: usize, options: &ReadOptions) -> Result<GltfScene, FormatError> {
        let mut scene = GltfScene {
            single: true,
            normals: Some(Vec::new()),
            colours: Some(Vec::new()),
            ..GltfScene::default()
        };
        let mut seen = vec![false; self.root.nodes.len()];
        let mut open: Vec<(usize, Matrix4<f64>)> =
            self.top_nodes()?.into_iter().rev().map(|node| (node, Matrix4::identity())).collect();
        while let Some((index, file_from_parent)) = open.pop() {
            let (Some(node), Some(placed), Some(seen)) =
                (self.root.nodes.get(index), self.nodes.get(index), seen.get_mut(index))
            else {
                return Err(content(format!("there is no node {index}")));
            };
            if std::mem::replace(seen, true) {
                return Err(content(format!("node {index} has two parents, or is its own")));
            }
            let file_from_node = file_from_parent * placed.parent_from_node();
            if let Some(mesh) = node.mesh {
                if node.skin.is_some() {
                    let problem =
                        format!("node {index} is bent by a skeleton (`skin`); save it posed, without");
                    return Err(content(problem));
                }
                self.add_mesh(mesh.value(), &file_from_node, held, options, &mut scene)?;
            }
            let children = node.children.iter().flatten().rev();
            open.extend(children.map(|child| (child.value(), file_from_node)));
        }
        Ok(scene)
    }

    fn add_mesh(
        &self,
        index: usize,
        file_from_node: &Matrix4<f64>,
        held: usize,
        options: &ReadOptions,
        scene: &mut GltfScene,
    ) -> Result<(), FormatError> {
        let mesh = self.root.meshes.get(index).ok_or_else(|| content(format!("there is no mesh {index}")))?;
        if mesh.weights.iter().flatten().any(|&weight| weight != 0.0) {
            let problem = format!("mesh {index} is bent by morph targets; save it posed, without them");
            return Err(content(problem));
        }
        // Primitives of several materials often share their points.
        let mut shared = BTreeMap::new();
        for primitive in &mesh.primitives {
            self.add_primitive(primitive, file_from_node, held, options, &mut shared, scene)?;
        }
        Ok(())
    }

    fn add_primitive(
        &self,
        primitive: &Primitive,
        file_from_node: &Matrix4<f64>,
        held: usize,
        options: &ReadOptions,
        shared: &mut BTreeMap<usize, (u32, usize)>,
        scene: &mut GltfScene,
    ) -> Result<(), FormatError> {
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let Some(positions) = attribute(Semantic::Positions) else { return Ok(()) };
        let (base, count) = match shared.get(&positions.value()) {
            Some(&place) => place,
            None => {
                let place = self.add_points(primitive, positions, file_from_node, held, options, scene)?;
                shared.insert(positions.value(), place);
                place
            }
        };
        let corners = match primitive.indices {
            Some(indices) => match self.numbers(indices)? {
                AccessorNumbers { components: 1, values, .. } => values,
                other => return Err(content(format!("indices of {} numbers each", other.components))),
            },
            None => (0..count).map(|index| index as f64).collect(),
        };
        if let Some(wrong) = corners.iter().find(|&&corner| corner >= count as f64) {
            return Err(content(format!("a triangle names point {wrong} of {count}")));
        }
        let corner = |at: usize| base + corners[at] as u32;
        let faces = triangles(primitive.mode, corners.len())?;
        let all = scene.faces.len().saturating_add(faces.len()).saturating_mul(size_of::<[u32; 3]>());
        options.check_memory(
            "the triangles",
            held.saturating_add(scene.points.len().saturating_mul(24)),
            all,
        )?;
        scene.loose += if faces.is_empty() { count } else { 0 };
        scene.faces.extend(faces.into_iter().map(|face| face.map(corner)));
        Ok(())
    }

    /// Appends the points of a primitive; the index of the first of them, and how many they are.
    fn add_points(
        &self,
        primitive: &Primitive,
        positions: Index<Accessor>,
        file_from_node: &Matrix4<f64>,
        held: usize,
        options: &ReadOptions,
        scene: &mut GltfScene,
    ) -> Result<(u32, usize), FormatError> {
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic)).copied();
        let positions = self.numbers(positions)?;
        if positions.components != 3 {
            return Err(content(format!("positions of {} numbers", positions.components)));
        }
        let points = positions.values.as_chunks::<3>().0;
        options.check_points(held, scene.points.len().saturating_add(points.len()))?;
        let base = u32::try_from(scene.points.len().saturating_add(points.len()))
            .map(|end| end - points.len() as u32)
            .map_err(|_| content("more than 4,294,967,295 points"))?;
        let still = *file_from_node == Matrix4::identity();
        let linear = file_from_node.fixed_view::<3, 3>(0, 0).into_owned();
        let translation = file_from_node.fixed_view::<3, 1>(0, 3).into_owned();
        scene.points.extend(
            points.iter().map(|&point| {
                if still { point } else { (linear * Vector3::from(point) + translation).into() }
            }),
        );
        scene.single &= positions.single && still;

        let normals = attribute(Semantic::Normals).map(|index| self.numbers(index)).transpose()?;
        scene.normals = scene.normals.take().zip(normals).and_then(|(mut all, normals)| {
            // Normals stand on the surface: the inverse of the transposed matrix turns them.
            let turn = if still { Matrix3::identity() } else { linear.try_inverse()?.transpose() };
            let turned = |&normal: &[f64; 3]| {
                if still { normal } else { (turn * Vector3::from(normal)).normalize().into() }
            };
            all.extend(normals.values.as_chunks::<3>().0.iter().map(turned));
            (all.len() == scene.points.len()).then_some(all)
        });
        let colours = attribute(Semantic::Colors(0)).map(|index| self.numbers(index)).transpose()?;
        scene.colours = scene.colours.take().zip(colours).and_then(|(mut all, colours)| {
            let size = colours.components;
            if !(3..=4).contains(&size) {
                return None;
            }
            all.extend(
                colours
                    .values
                    .chunks_exact(size)
                    .map(|c| [c[0], c[1], c[2], c.get(3).copied().unwrap_or(1.0)]),
            );
            (all.len() == scene.points.len()).then_some(all)
        });
        Ok((base, points.len()))
    }
}

/// The triangles of `count` corners, as places in the list of corners; none where a primitive has no surface.
fn triangles(mode: Checked<Mode>, count: usize) -> Result<Vec<[usize; 3]>, FormatError> {
    let Checked::Valid(mode) = mode else { return Err(content("a primitive of an unknown mode")) };
    Ok(match mode {
        Mode::Triangles => (0..count / 3).map(|index| [3 * index, 3 * index + 1, 3 * index + 2]).collect(),
        Mode::TriangleStrip => {
            let face =
                |at: usize| if at.is_multiple_of(2) { [at, at + 1, at + 2] } else { [at + 1, at, at + 2] };
            (0..count.saturating_sub(2)).map(face).collect()
        }
        Mode::TriangleFan => (1..count.saturating_sub(1)).map(|at| [0, at, at + 1]).collect(),
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => Vec::new(),
    })
}
