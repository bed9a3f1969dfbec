//! The statements of an OBJ file: vertices, faces, groups, materials.

use super::lines::Lines;
use super::parts::{Corner, Heads, PartBuilder, Vertices};
use crate::error::{ErrorKind, SceneError};
use crate::options::LoadOptions;
use crate::ply::srgb_to_linear;
use crate::polygon::Triangulator;
use crate::source;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// What an OBJ file says, before its materials are known.
#[derive(Default)]
pub(super) struct Statements {
    pub vertices: Vertices,
    pub parts: Vec<PartBuilder>,
    /// Names after `mtllib`, in order.
    pub libraries: Vec<String>,
    /// Materials by name with the line that first names them.
    pub used_materials: BTreeMap<String, (usize, String)>,
    /// Polygons that became fans though they are not convex.
    pub fanned: u64,
    /// Faces with fewer than three corners.
    pub skipped: u64,
}

/// What is read in one run over the file. Faces may name vertices that come later: then vertices are read first.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Pass {
    All,
    Vertices,
    Faces,
}

/// Reads a file.
pub(super) fn read(path: &Path, options: &LoadOptions) -> Result<Statements, SceneError> {
    let mut reader = Reader::new(options);
    if reader.run(path, Pass::All)? {
        return Ok(reader.finish());
    }
    let mut reader = Reader::new(options);
    reader.run(path, Pass::Vertices)?;
    reader.run(path, Pass::Faces)?;
    Ok(reader.finish())
}

struct Reader<'o> {
    options: &'o LoadOptions,
    out: Statements,
    triangulator: Triangulator,
    heads: Heads,
    /// Part of each group and material.
    known: HashMap<(String, Option<String>), usize>,
    group: String,
    material: Option<String>,
    /// The part that faces go to, if that is known.
    part: Option<usize>,
    /// Smoothing group in force: 0 is none.
    smoothing: u32,
    smoothing_names: HashMap<Vec<u8>, u32>,
    /// Vertices, texture coordinates and normals up to this line.
    counts: [usize; 3],
    face: Vec<Corner>,
    triangles: u64,
}

impl<'o> Reader<'o> {
    fn new(options: &'o LoadOptions) -> Self {
        Self {
            options,
            out: Statements::default(),
            triangulator: Triangulator::default(),
            heads: Heads::default(),
            known: HashMap::new(),
            group: "unnamed_object".to_owned(),
            material: None,
            part: None,
            smoothing: 0,
            smoothing_names: HashMap::new(),
            counts: [0; 3],
            face: Vec::new(),
            triangles: 0,
        }
    }

    fn finish(mut self) -> Statements {
        self.out.fanned = self.triangulator.given_up();
        self.out
    }

    /// One run over the file; false if a face names what has not come yet.
    fn run(&mut self, path: &Path, pass: Pass) -> Result<bool, SceneError> {
        let (file, _) = source::open(path, self.options)?;
        let mut lines = Lines::new(file, path);
        self.counts = [0; 3];
        let at =
            |lines: &Lines, message: String| SceneError::new(ErrorKind::Value, message).at(&lines.span());
        while lines.advance()? {
            let (key, rest) = lines.words();
            let result = match key {
                b"v" => self.vertex(rest, pass),
                b"vt" => self.texture_coordinates(rest, pass),
                b"vn" => self.normal(rest, pass),
                _ if pass == Pass::Vertices => Ok(()),
                b"f" => match self.face(rest, pass) {
                    Ok(true) => Ok(()),
                    Ok(false) => return Ok(false),
                    Err(message) => Err(message),
                },
                b"g" | b"o" => {
                    self.group = text(rest);
                    self.part = None;
                    Ok(())
                }
                b"usemtl" if rest.is_empty() => Err("the name of the material is missing".to_owned()),
                b"usemtl" => {
                    let name = text(rest);
                    let place = || (lines.number(), lines.text());
                    self.out.used_materials.entry(name.clone()).or_insert_with(place);
                    self.material = Some(name);
                    self.part = None;
                    Ok(())
                }
                b"mtllib" => {
                    self.out.libraries.push(text(rest));
                    Ok(())
                }
                b"s" => {
                    self.smoothing = match rest {
                        b"" | b"off" | b"0" => 0,
                        name => {
                            let next = self.smoothing_names.len() as u32 + 1;
                            *self.smoothing_names.entry(name.to_vec()).or_insert(next)
                        }
                    };
                    Ok(())
                }
                other if other.contains(&0) => Err("this is not text: an OBJ file is plain text".to_owned()),
                _ => Ok(()),
            };
            result.map_err(|message| at(&lines, message))?;
            if self.triangles > self.options.max_triangles {
                let error =
                    self.options.exceeded("max_triangles", self.options.max_triangles, self.triangles);
                return Err(error.in_file(path));
            }
            let most = self.counts.into_iter().max().unwrap_or(0) as u64;
            if most > self.options.max_vertices {
                return Err(self
                    .options
                    .exceeded("max_vertices", self.options.max_vertices, most)
                    .in_file(path));
            }
        }
        Ok(true)
    }

    fn vertex(&mut self, rest: &[u8], pass: Pass) -> Result<(), String> {
        self.counts[0] += 1;
        if pass == Pass::Faces {
            return Ok(());
        }
        let (n, count) = numbers::<7>(rest)?;
        let mut p = [n[0], n[1], n[2]];
        match count {
            0..3 => return Err("a vertex needs three numbers".to_owned()),
            4 if n[3] == 0.0 => return Err("the weight of a vertex must not be 0".to_owned()),
            4 => p = p.map(|v| v / n[3]),
            3 | 6 | 7 => {}
            _ => return Err("a vertex has 3, 4 or 6 numbers".to_owned()),
        }
        if !p.iter().all(|v| v.is_finite()) {
            return Err("the vertex is not finite".to_owned());
        }
        let Vertices { positions, colors, .. } = &mut self.out.vertices;
        if count >= 6 {
            colors.resize(positions.len(), [f32::NAN; 3]);
            colors.push([n[3], n[4], n[5]].map(|v| srgb_to_linear(v.clamp(0.0, 1.0))));
        }
        positions.push(p);
        Ok(())
    }

    fn texture_coordinates(&mut self, rest: &[u8], pass: Pass) -> Result<(), String> {
        self.counts[1] += 1;
        if pass == Pass::Faces {
            return Ok(());
        }
        let (n, count) = numbers::<3>(rest)?;
        if count == 0 {
            return Err("texture coordinates need two numbers".to_owned());
        }
        self.out.vertices.uvs.push([n[0], n[1]]);
        Ok(())
    }

    fn normal(&mut self, rest: &[u8], pass: Pass) -> Result<(), String> {
        self.counts[2] += 1;
        if pass == Pass::Faces {
            return Ok(());
        }
        let (n, count) = numbers::<3>(rest)?;
        if count < 3 {
            return Err("a normal needs three numbers".to_owned());
        }
        self.out.vertices.normals.push(n);
        Ok(())
    }

    /// `false` if a corner is not known yet.
    fn face(&mut self, rest: &[u8], pass: Pass) -> Result<bool, String> {
        self.face.clear();
        let mut face = std::mem::take(&mut self.face);
        for word in without_comment(rest) {
            match self.corner(word, pass)? {
                Some(corner) => face.push(corner),
                None => return Ok(false),
            }
        }
        match face.len() {
            0 => return Err("a face needs corners".to_owned()),
            1 | 2 => self.out.skipped += 1,
            count => {
                let part = match self.part {
                    Some(part) => part,
                    None => self.open_part(),
                };
                let Statements { vertices, parts, .. } = &mut self.out;
                let (part, heads) = (&mut parts[part], &mut self.heads);
                if let [a, b, c] = face[..] {
                    part.triangle([a, b, c], heads);
                } else {
                    let position = |i: usize| vertices.positions[face[i].v as usize].into();
                    self.triangulator.split(count, position, |t| {
                        part.triangle(t.map(|i| face[i]), heads);
                    });
                }
                self.triangles += count as u64 - 2;
                self.options.count_triangles(count as u64 - 2);
            }
        }
        self.face = face;
        Ok(true)
    }

    fn open_part(&mut self) -> usize {
        let key = (self.group.clone(), self.material.clone());
        let parts = &mut self.out.parts;
        let part = *self.known.entry(key).or_insert_with(|| {
            let number = parts.len() as u32;
            parts.push(PartBuilder::new(self.group.clone(), self.material.clone(), number));
            parts.len() - 1
        });
        self.part = Some(part);
        part
    }

    fn corner(&self, word: &[u8], pass: Pass) -> Result<Option<Corner>, String> {
        let mut all = [Corner::NONE; 3];
        let totals =
            [self.out.vertices.positions.len(), self.out.vertices.uvs.len(), self.out.vertices.normals.len()];
        for (k, part) in word.split(|b| *b == b'/').enumerate() {
            if part.is_empty() && k > 0 {
                continue;
            }
            let value = std::str::from_utf8(part).ok().and_then(|text| text.parse::<i64>().ok());
            let (Some(value), true) = (value, k < 3) else {
                return Err(format!("`{}` is not a corner of a face", shown(word)));
            };
            let count = self.counts[k] as i64;
            if value == 0 || value < -count || value > i64::from(u32::MAX) {
                return Err(format!("index {value} does not exist: there are {count} so far"));
            }
            let index = if value > 0 { value - 1 } else { count + value };
            if index >= totals[k] as i64 {
                if pass == Pass::All {
                    return Ok(None);
                }
                let what = ["a vertex", "texture coordinates", "a normal"][k];
                let verb = if k == 1 { "do" } else { "does" };
                return Err(format!("a face names {what} that {verb} not exist"));
            }
            all[k] = index as u32;
        }
        let [v, vt, vn] = all;
        let vn = if vn == Corner::NONE { Corner::smooth(self.smoothing) } else { vn };
        Ok(Some(Corner { v, vt, vn }))
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn shown(word: &[u8]) -> String {
    String::from_utf8_lossy(word).chars().take(20).collect()
}

/// The words up to a comment.
fn without_comment(rest: &[u8]) -> impl Iterator<Item = &[u8]> {
    let words = rest.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    words.take_while(|word| word[0] != b'#')
}

/// Up to `N` numbers and how many there are; more are left out.
fn numbers<const N: usize>(rest: &[u8]) -> Result<([f32; N], usize), String> {
    let mut all = [0.0; N];
    let mut count = 0;
    for (value, word) in all.iter_mut().zip(without_comment(rest)) {
        let number = std::str::from_utf8(word).ok().and_then(|text| text.parse::<f32>().ok());
        match number {
            Some(number) if number.is_finite() => *value = number,
            Some(_) => return Err(format!("`{}` is not finite", shown(word))),
            None => return Err(format!("`{}` is not a number", shown(word))),
        }
        count += 1;
    }
    Ok((all, count))
}
