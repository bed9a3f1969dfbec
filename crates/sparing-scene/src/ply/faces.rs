//! The element `face`: polygons become triangles.

use super::header::{Element, Format, Property, Scalar};
use super::input::Input;
use super::values::{Values, error_at};
use crate::description::TriangleMesh;
use crate::error::{ErrorKind, SceneError};
use crate::options::LoadOptions;
use crate::polygon::Triangulator;
use crate::warnings::Warnings;

/// Faces that are handled at a time, in bytes.
const BATCH: usize = 1 << 16;

/// Collects triangles.
pub(super) struct Faces<'a> {
    mesh: &'a mut TriangleMesh,
    triangulator: Triangulator,
    options: &'a LoadOptions,
    /// Faces with fewer than three corners.
    skipped: u64,
}

/// Which property has the corners.
fn corners_of(element: &Element) -> Result<usize, SceneError> {
    let found = element.find("vertex_indices").or_else(|| element.find("vertex_index"));
    let list = found.filter(|&i| {
        let property = &element.properties[i];
        property.count.is_some() && property.item.is_integer()
    });
    list.ok_or_else(|| {
        let message = "a face needs `vertex_indices`, a list of whole numbers";
        SceneError::new(ErrorKind::Value, message)
    })
}

/// Reads all faces of an element into the mesh.
pub(super) fn read(
    values: &mut Values,
    element: &Element,
    mesh: &mut TriangleMesh,
    options: &LoadOptions,
    warnings: &mut Warnings,
) -> Result<(), SceneError> {
    let corners = corners_of(element)?;
    mesh.indices.reserve_exact(element.count as usize); // checked by the caller
    let mut faces = Faces { mesh, triangulator: Triangulator::default(), options, skipped: 0 };
    let mut left = element.count;
    if let (Values::Binary { input, format: Format::Little }, [only]) =
        (&mut *values, &element.properties[..])
        && let (Some(Scalar::U8), Scalar::I32 | Scalar::U32) = (only.count, only.item)
    {
        left = faces.read_plain(input, left)?;
    }
    let mut polygon = Vec::new();
    for _ in 0..left {
        for (i, property) in element.properties.iter().enumerate() {
            match property.count {
                Some(count) if i == corners => read_list(values, property, count, &mut polygon)?,
                _ => values.skip(property)?,
            }
        }
        faces.add(&polygon).map_err(|message| values.error(message))?;
        faces.check_limit()?;
    }
    if faces.skipped > 0 {
        warnings.add(format!("{} faces with fewer than three corners are left out", faces.skipped));
    }
    let fanned = faces.triangulator.given_up();
    if fanned > 0 {
        warnings.add(format!("{fanned} faces that are not convex have too many corners: they become fans"));
    }
    Ok(())
}

fn read_list(
    values: &mut Values,
    property: &Property,
    count: Scalar,
    polygon: &mut Vec<u32>,
) -> Result<(), SceneError> {
    let length = values.list_length(count, property.item)?;
    polygon.clear();
    for _ in 0..length {
        let index = values.next(property.item)?;
        // Out of the range of `u32` is out of range of the vertices, too.
        polygon.push(if (0.0..4294967295.0).contains(&index) { index as u32 } else { u32::MAX });
    }
    Ok(())
}

impl Faces<'_> {
    /// Faces that are nothing but `u8` corners and as many `u32`: nearly all files in the wild. Reads until the
    /// last batch and gives how many are left.
    fn read_plain(&mut self, input: &mut Input, mut left: u64) -> Result<u64, SceneError> {
        // Bytes of the largest face.
        const LARGEST: usize = 1 + 4 * 255;
        while left > 0 {
            let start = input.offset();
            let bytes = input.fill(BATCH)?;
            let mut at = 0;
            while left > 0 {
                let Some(row) = bytes.get(at..at + LARGEST) else { break };
                if row[0] == 3 {
                    let triangle =
                        [1, 5, 9].map(|i| u32::from_le_bytes([row[i], row[i + 1], row[i + 2], row[i + 3]]));
                    at += 13;
                    let largest = triangle[0].max(triangle[1]).max(triangle[2]);
                    if largest as usize >= self.mesh.positions.len() {
                        return Err(error_at(self.out_of_range(largest), start + at as u64));
                    }
                    self.mesh.indices.push(triangle);
                } else {
                    let corners = usize::from(row[0]);
                    let words = row[1..=4 * corners].as_chunks::<4>().0;
                    let mut polygon = [0; 255];
                    polygon.iter_mut().zip(words).for_each(|(i, word)| *i = u32::from_le_bytes(*word));
                    at += 1 + 4 * corners;
                    self.add(&polygon[..corners]).map_err(|message| error_at(message, start + at as u64))?;
                }
                left -= 1;
            }
            self.check_limit()?;
            if at == 0 {
                break; // the end of the file is near
            }
            input.advance(at);
        }
        Ok(left)
    }

    fn out_of_range(&self, index: u32) -> String {
        let count = self.mesh.positions.len();
        match i64::from(index) {
            i if i == i64::from(u32::MAX) => {
                format!("a face names a vertex that does not exist: there are {count}")
            }
            i => format!("a face names vertex {i}, but there are {count}"),
        }
    }

    fn add(&mut self, polygon: &[u32]) -> Result<(), String> {
        let positions = &self.mesh.positions;
        if let Some(&index) = polygon.iter().find(|&&i| i as usize >= positions.len()) {
            return Err(self.out_of_range(index));
        }
        match *polygon {
            [a, b, c] => self.mesh.indices.push([a, b, c]),
            [] | [_] | [_, _] => self.skipped += 1,
            _ => {
                let indices = &mut self.mesh.indices;
                let position = |corner: usize| positions[polygon[corner] as usize].into();
                self.triangulator.split(polygon.len(), position, |triangle| {
                    indices.push(triangle.map(|corner| polygon[corner]));
                });
            }
        }
        Ok(())
    }

    fn check_limit(&self) -> Result<(), SceneError> {
        let triangles = self.mesh.indices.len() as u64;
        if triangles > self.options.max_triangles {
            return Err(self.options.exceeded("max_triangles", self.options.max_triangles, triangles));
        }
        Ok(())
    }
}
