//! The element `vertex`.

use super::header::{Element, Format, Scalar};
use super::input::Input;
use super::values::{Values, error_at};
use crate::description::TriangleMesh;
use crate::error::{ErrorKind, SceneError};

/// Values that are kept of a vertex, by name; texture coordinates have several.
const NAMES: [&str; 17] = [
    "x", "y", "z", "nx", "ny", "nz", "u", "v", "red", "green", "blue", "alpha", "u2", "v2", "tx", "ty", "tz",
];
const COORDINATES: [[&str; 2]; 4] =
    [["u", "v"], ["s", "t"], ["texture_u", "texture_v"], ["texture_s", "texture_t"]];
/// Vertices that are handled at a time: their bytes stay in the cache.
const BATCH: u64 = 4096;

/// Which property is which value.
struct Layout {
    /// Property of each of [`NAMES`].
    of: [Option<usize>; NAMES.len()],
    normals: bool,
    uvs: bool,
    second_uvs: bool,
    tangents: bool,
    /// What the numbers of a colour are divided by.
    colors: Option<f32>,
}

impl Layout {
    fn new(element: &Element) -> Result<Self, SceneError> {
        let mut of = NAMES.map(|name| element.find(name));
        let pair = COORDINATES.iter().find_map(|names| {
            let [u, v] = names.map(|name| element.find(name));
            u.zip(v)
        });
        (of[6], of[7]) = (pair.map(|p| p.0), pair.map(|p| p.1));
        let is_list = |i: usize| element.properties[i].count.is_some();
        if of[..3].iter().any(Option::is_none) || of.iter().flatten().any(|&i| is_list(i)) {
            return Err(SceneError::new(ErrorKind::Value, "a vertex needs the numbers x, y and z"));
        }
        let all = |range: std::ops::Range<usize>| of[range].iter().all(Option::is_some);
        let colors = all(8..11).then(|| of[8].map_or(1.0, |i| element.properties[i].item.full()));
        let (second_uvs, tangents) = (all(12..14), all(14..17));
        Ok(Self { normals: all(3..6), uvs: pair.is_some(), colors, second_uvs, tangents, of })
    }
}

/// Reads all vertices of an element into the mesh.
pub(super) fn read(
    values: &mut Values,
    element: &Element,
    mesh: &mut TriangleMesh,
) -> Result<(), SceneError> {
    let layout = Layout::new(element)?;
    let count = element.count as usize; // checked by the caller against limits and the size of the file
    mesh.positions.reserve_exact(count);
    mesh.normals = layout.normals.then(|| Vec::with_capacity(count));
    mesh.uvs = layout.uvs.then(|| Vec::with_capacity(count));
    mesh.colors = layout.colors.map(|_| Vec::with_capacity(count));
    mesh.second_uvs = layout.second_uvs.then(|| Vec::with_capacity(count));
    mesh.tangents = layout.tangents.then(|| Vec::with_capacity(count));
    match values {
        Values::Binary { input, format } if element.properties.iter().all(|p| p.count.is_none()) => {
            read_rows(input, *format, element, &layout, mesh)?;
        }
        _ => read_one_by_one(values, element, &layout, mesh)?,
    }
    if let (Some(full), Some(colors)) = (layout.colors, &mut mesh.colors) {
        decode_colors(colors, full);
    }
    Ok(())
}

/// Vertices of equal size: whole columns of a batch at a time.
fn read_rows(
    input: &mut Input,
    format: Format,
    element: &Element,
    layout: &Layout,
    mesh: &mut TriangleMesh,
) -> Result<(), SceneError> {
    let mut offsets = Vec::new();
    let mut size = 0;
    for property in &element.properties {
        offsets.push((size, property.item));
        size += property.item.size();
    }
    let place = |i: usize| layout.of[i].map(|property| offsets[property]);
    let mut left = element.count;
    while left > 0 {
        let batch = left.min(BATCH);
        let start = input.offset();
        let rows = input.take(batch as usize * size)?;
        let rows = Rows { bytes: rows, size, format };
        let first = mesh.positions.len();
        rows.columns([0, 1, 2].map(place), 0.0, &mut mesh.positions);
        if let Some(normals) = &mut mesh.normals {
            rows.columns([3, 4, 5].map(place), 0.0, normals);
        }
        if let Some(uvs) = &mut mesh.uvs {
            rows.columns([6, 7].map(place), 0.0, uvs);
        }
        if let Some(colors) = &mut mesh.colors {
            rows.columns([8, 9, 10, 11].map(place), layout.colors.unwrap_or(1.0), colors);
        }
        if let Some(uvs) = &mut mesh.second_uvs {
            rows.columns([12, 13].map(place), 0.0, uvs);
        }
        if let Some(tangents) = &mut mesh.tangents {
            rows.columns([14, 15, 16].map(place), 0.0, tangents);
        }
        let finite = |values: &[f32]| values.iter().fold(true, |all, v| all & v.is_finite());
        let new = |values: &Option<Vec<[f32; 3]>>| {
            values.as_ref().is_none_or(|v| finite(v[first..].as_flattened()))
        };
        let pairs = |values: &Option<Vec<[f32; 2]>>| {
            values.as_ref().is_none_or(|v| finite(v[first..].as_flattened()))
        };
        let uvs = pairs(&mesh.uvs) && pairs(&mesh.second_uvs);
        let colors = mesh.colors.as_ref().is_none_or(|c| finite(c[first..].as_flattened()));
        if !(finite(mesh.positions[first..].as_flattened())
            && new(&mesh.normals)
            && new(&mesh.tangents)
            && uvs
            && colors)
        {
            let message = format!("a vertex after byte {start} is not finite");
            return Err(error_at(message, input.offset()));
        }
        left -= batch;
    }
    Ok(())
}

struct Rows<'a> {
    bytes: &'a [u8],
    size: usize,
    format: Format,
}

impl Rows<'_> {
    /// Appends some columns of all rows; a column that is not there is `missing`.
    fn columns<const N: usize>(
        &self,
        places: [Option<(usize, Scalar)>; N],
        missing: f32,
        out: &mut Vec<[f32; N]>,
    ) {
        let plain = self.format == Format::Little
            && places.iter().all(|p| p.is_some_and(|(_, item)| item == Scalar::F32));
        let rows = self.bytes.chunks_exact(self.size);
        if plain {
            let offsets = places.map(|p| p.map_or(0, |p| p.0));
            let together = (1..N).all(|i| offsets[i] == offsets[0] + 4 * i);
            let one = |row: &[u8], at: usize| {
                row[at..].first_chunk().map_or(0.0, |&bytes| f32::from_le_bytes(bytes))
            };
            if together {
                let span = offsets[0]..offsets[0] + 4 * N;
                out.extend(rows.map(|row| {
                    let row = &row[span.clone()];
                    std::array::from_fn(|i| one(row, 4 * i))
                }));
            } else {
                out.extend(rows.map(|row| offsets.map(|at| one(row, at))));
            }
        } else {
            out.extend(rows.map(|row| {
                places.map(|place| match place {
                    Some((at, item)) => item.read(&row[at..], self.format) as f32,
                    None => missing,
                })
            }));
        }
    }
}

fn read_one_by_one(
    values: &mut Values,
    element: &Element,
    layout: &Layout,
    mesh: &mut TriangleMesh,
) -> Result<(), SceneError> {
    // The slot of each property; the last one is for what is not kept.
    let slots: Vec<usize> = (0..element.properties.len())
        .map(|i| layout.of.iter().position(|of| *of == Some(i)).unwrap_or(NAMES.len()))
        .collect();
    for _ in 0..element.count {
        let mut row = [0.0f32; NAMES.len() + 1];
        row[11] = layout.colors.unwrap_or(1.0);
        for (property, &slot) in element.properties.iter().zip(&slots) {
            if property.count.is_some() {
                values.skip(property)?;
                continue;
            }
            let value = values.next(property.item)? as f32;
            if slot < NAMES.len() && !value.is_finite() {
                return Err(values.error(format!("{} of a vertex is not finite", NAMES[slot])));
            }
            row[slot] = value;
        }
        let [x, y, z, nx, ny, nz, u, v, red, green, blue, alpha, u2, v2, tx, ty, tz, _] = row;
        mesh.positions.push([x, y, z]);
        if let Some(normals) = &mut mesh.normals {
            normals.push([nx, ny, nz]);
        }
        if let Some(uvs) = &mut mesh.uvs {
            uvs.push([u, v]);
        }
        if let Some(colors) = &mut mesh.colors {
            colors.push([red, green, blue, alpha]);
        }
        if let Some(uvs) = &mut mesh.second_uvs {
            uvs.push([u2, v2]);
        }
        if let Some(tangents) = &mut mesh.tangents {
            tangents.push([tx, ty, tz]);
        }
    }
    Ok(())
}

/// Whole numbers are sRGB, as in pictures; floating-point ones are linear already.
fn decode_colors(colors: &mut [[f32; 4]], full: f32) {
    let bytes: [f32; 256] = std::array::from_fn(|i| srgb_to_linear(i as f32 / 255.0));
    let linear = |v: f32| match full {
        1.0 => v.max(0.0),
        255.0 => bytes[v as u8 as usize],
        full => srgb_to_linear((v / full).clamp(0.0, 1.0)),
    };
    for color in colors {
        let [r, g, b, a] = *color;
        *color = [linear(r), linear(g), linear(b), (a / full).clamp(0.0, 1.0)];
    }
}

/// The sRGB transfer function, undone (IEC 61966-2-1).
pub(crate) fn srgb_to_linear(v: f32) -> f32 {
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}
