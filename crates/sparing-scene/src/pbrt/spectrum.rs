//! Spectrum-valued parameters and pbrt's named spectra.
//!
//! How colours of lights become radiance (the same pictures as pbrt-v4, whose lights divide by
//! `SpectrumToPhotometric`): an `rgb` is taken as it stands, so `rgb L [1 1 1]` has luminance 1 and a red light
//! less; `blackbody` and tabulated spectra are normalised to luminance 1 before `scale`.

use super::colorspace::ColorSpace;
use super::params::{Param, ParamType, Values};
use crate::error::{ErrorKind, SceneError, did_you_mean};
use crate::options::LoadOptions;
use crate::spectrum;
use glam::Vec3;
use std::path::PathBuf;

/// What a spectrum describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    /// A reflectance, at most 1.
    Albedo,
    /// An index of refraction or the like.
    Unbounded,
    /// A light of pbrt-v4.
    Illuminant,
    /// A light of older versions, whose spectra are not normalised to luminance 1.
    OldIlluminant,
}

/// Looks up a file that a scene names.
pub(super) type FindFile<'a> = &'a dyn Fn(&str) -> Result<Option<PathBuf>, SceneError>;

/// Optical constants n, k by photon energy in eV: P. B. Johnson and R. W. Christy, "Optical Constants of the
/// Noble Metals", Phys. Rev. B 6, 4370 (1972), table I.
const COPPER: &[[f64; 3]] = &[
    [1.64, 0.24, 4.665],
    [1.76, 0.21, 4.205],
    [1.88, 0.22, 3.747],
    [2.01, 0.30, 3.205],
    [2.14, 0.70, 2.704],
    [2.26, 1.02, 2.577],
    [2.38, 1.18, 2.608],
    [2.50, 1.22, 2.564],
    [2.63, 1.25, 2.483],
    [2.75, 1.24, 2.397],
    [2.88, 1.25, 2.305],
    [3.00, 1.28, 2.207],
    [3.12, 1.32, 2.116],
    [3.25, 1.33, 2.045],
];
const SILVER: &[[f64; 3]] = &[
    [1.64, 0.03, 5.242],
    [1.76, 0.04, 4.838],
    [1.88, 0.05, 4.483],
    [2.01, 0.06, 4.152],
    [2.14, 0.05, 3.858],
    [2.26, 0.06, 3.586],
    [2.38, 0.05, 3.324],
    [2.50, 0.05, 3.093],
    [2.63, 0.05, 2.869],
    [2.75, 0.04, 2.657],
    [2.88, 0.04, 2.462],
    [3.00, 0.05, 2.275],
    [3.12, 0.05, 2.070],
    [3.25, 0.05, 1.864],
];
const GOLD: &[[f64; 3]] = &[
    [1.64, 0.14, 4.542],
    [1.76, 0.13, 4.103],
    [1.88, 0.14, 3.697],
    [2.01, 0.21, 3.272],
    [2.14, 0.29, 2.863],
    [2.26, 0.43, 2.455],
    [2.38, 0.62, 2.081],
    [2.50, 1.04, 1.833],
    [2.63, 1.31, 1.849],
    [2.75, 1.38, 1.914],
    [2.88, 1.45, 1.948],
    [3.00, 1.46, 1.958],
    [3.12, 1.47, 1.952],
    [3.25, 1.46, 1.933],
];
/// n, k by wavelength in nm: D. Y. Smith, E. Shiles, M. Inokuti in "Handbook of Optical Constants of Solids" (1985).
const ALUMINIUM: &[[f64; 3]] = &[
    [400.0, 0.490, 4.86],
    [450.0, 0.618, 5.47],
    [500.0, 0.769, 6.08],
    [550.0, 0.958, 6.69],
    [600.0, 1.20, 7.26],
    [650.0, 1.47, 7.79],
    [700.0, 1.83, 8.31],
];
/// Brass of 70 % copper, 30 % zinc at 450, 550 and 650 nm: M. R. Querry, CRDC-CR-85034 (1985).
const BRASS: &[[f64; 3]] = &[[450.0, 1.094, 1.829], [550.0, 0.527, 2.765], [650.0, 0.444, 3.695]];

/// Index of refraction at the sodium D line of pbrt's named glasses (makers' data sheets).
const GLASSES: &[(&str, f32)] = &[
    ("glass-BK7", 1.5168),
    ("glass-BAF10", 1.67),
    ("glass-FK51A", 1.4866),
    ("glass-LASF9", 1.8503),
    ("glass-F5", 1.6034),
    ("glass-SF5", 1.6727),
    ("glass-SF10", 1.7283),
    ("glass-SF11", 1.7847),
];

const NAMES: &[&str] = &[
    "metal-Ag-eta",
    "metal-Ag-k",
    "metal-Al-eta",
    "metal-Al-k",
    "metal-Au-eta",
    "metal-Au-k",
    "metal-Cu-eta",
    "metal-Cu-k",
    "metal-CuZn-eta",
    "metal-CuZn-k",
    "metal-MgO-eta",
    "metal-MgO-k",
    "metal-TiO2-eta",
    "metal-TiO2-k",
];

/// The colour of a named surface spectrum.
pub(super) fn named(name: &str) -> Option<Vec3> {
    if let Some((_, eta)) = GLASSES.iter().find(|(known, _)| *known == name) {
        return Some(Vec3::splat(*eta));
    }
    let (metal, part) = name.strip_prefix("metal-")?.rsplit_once('-')?;
    let column = match part {
        "eta" => 1,
        "k" => 2,
        _ => return None,
    };
    let energies = |table: &[[f64; 3]]| {
        let mut table: Vec<_> = table.iter().map(|row| [1239.842 / row[0], row[column]]).collect();
        table.reverse();
        Some(spectrum::surface_rgb(&table))
    };
    let wavelengths = |table: &[[f64; 3]]| {
        let table: Vec<_> = table.iter().map(|row| [row[0], row[column]]).collect();
        Some(spectrum::surface_rgb(&table))
    };
    // A transparent crystal by its dispersion formula n²(λ²), λ in µm.
    let crystal = |n2: fn(f64) -> f64| {
        let index = |nm: f64| if column == 1 { n2(nm * nm * 1e-6).sqrt() } else { 0.0 };
        let table: Vec<_> = (0..9).map(|i| 380.0 + 50.0 * f64::from(i)).map(|nm| [nm, index(nm)]).collect();
        Some(spectrum::surface_rgb(&table))
    };
    match metal {
        "Ag" => energies(SILVER),
        "Al" => wavelengths(ALUMINIUM),
        "Au" => energies(GOLD),
        "Cu" => energies(COPPER),
        "CuZn" => wavelengths(BRASS),
        // R. E. Stephens, I. H. Malitson, J. Res. NBS 49, 249 (1952).
        "MgO" => crystal(|l2| {
            2.956_362 - 0.010_623_87 * l2 - 0.000_020_496_8 * l2 * l2 + 0.021_957_7 / (l2 - 0.014_283_22)
        }),
        // Rutile, ordinary ray: J. R. DeVore, J. Opt. Soc. Am. 41, 416 (1951).
        "TiO2" => crystal(|l2| 5.913 + 0.2441 / (l2 - 0.0803)),
        _ => None,
    }
}

/// The colour that a spectrum-like parameter stands for; `base` is the folder of spectrum files.
pub(super) fn color(
    param: &Param,
    quantity: Quantity,
    space: ColorSpace,
    find: FindFile<'_>,
    options: &LoadOptions,
) -> Result<Vec3, SceneError> {
    let is_light = matches!(quantity, Quantity::Illuminant | Quantity::OldIlluminant);
    let value = match (param.ty, &param.values) {
        (ParamType::Rgb | ParamType::Xyz, Values::Floats(values)) => match values[..] {
            // Indices of refraction are no colours.
            [r, g, b] if param.ty == ParamType::Rgb && quantity == Quantity::Unbounded => Vec3::new(r, g, b),
            [r, g, b] if param.ty == ParamType::Rgb => space.to_rec709(Vec3::new(r, g, b), is_light),
            [x, y, z] => spectrum::xyz_rgb(Vec3::new(x, y, z)).max(Vec3::ZERO),
            _ => {
                let (name, count) = (&param.name, values.len());
                return Err(param.error(format!("`{name}` takes 3 numbers, not {count}")));
            }
        },
        (ParamType::Float, Values::Floats(values)) => match values[..] {
            [value] => Vec3::splat(value),
            _ => return Err(param.error(format!("`{}` takes one number", param.name))),
        },
        (ParamType::Blackbody, Values::Floats(values)) => {
            let (kelvin, scale) = match values[..] {
                [kelvin] => (kelvin, 1.0),
                [kelvin, scale] => (kelvin, scale),
                _ => return Err(param.error(format!("`{}` takes a temperature in kelvin", param.name))),
            };
            let range = 500.0..=1e6;
            if !range.contains(&kelvin) {
                let message = format!("the temperature must be from 500 to 1000000 K, not {kelvin}");
                return Err(param.value_error(0, message));
            }
            if quantity == Quantity::OldIlluminant {
                spectrum::blackbody_by_peak(f64::from(kelvin)) * scale
            } else {
                spectrum::blackbody_rgb(f64::from(kelvin)).unwrap_or(Vec3::ONE) * scale
            }
        }
        (ParamType::Spectrum, Values::Floats(values)) => tabulated(param, values, quantity)?,
        (ParamType::Spectrum, Values::Strings(names)) => match &names[..] {
            [name] => by_name(param, name, quantity, find, options)?,
            _ => return Err(param.error(format!("`{}` takes one name", param.name))),
        },
        _ => {
            let (name, ty) = (&param.name, param.ty.name());
            return Err(param.error(format!("`{name}` should be a colour (rgb, spectrum, ...), not {ty}")));
        }
    };
    if value.min_element() < 0.0 {
        return Err(param.value_error(0, format!("`{}` must not be negative", param.name)));
    }
    Ok(value)
}

fn tabulated(param: &Param, values: &[f32], quantity: Quantity) -> Result<Vec3, SceneError> {
    let (pairs, rest) = values.as_chunks::<2>();
    if pairs.is_empty() || !rest.is_empty() {
        return Err(param.error(format!("`{}` takes pairs of wavelength and value", param.name)));
    }
    let table: Vec<[f64; 2]> = pairs.iter().map(|p| p.map(f64::from)).collect();
    if let Some(i) = table.windows(2).position(|pair| pair[0][0] >= pair[1][0]) {
        return Err(param.value_error(2 * i + 2, "wavelengths must increase"));
    }
    from_table(param, &table, quantity)
}

fn from_table(param: &Param, table: &[[f64; 2]], quantity: Quantity) -> Result<Vec3, SceneError> {
    if quantity == Quantity::OldIlluminant {
        return Ok(spectrum::plain_rgb(table));
    }
    if quantity == Quantity::Illuminant {
        let dark = || param.error("this spectrum has no light in the visible range");
        spectrum::light_rgb(table).ok_or_else(dark)
    } else {
        Ok(spectrum::surface_rgb(table))
    }
}

fn by_name(
    param: &Param,
    name: &str,
    quantity: Quantity,
    find: FindFile<'_>,
    options: &LoadOptions,
) -> Result<Vec3, SceneError> {
    if let Some(rest) = name.strip_prefix("stdillum-") {
        let kelvin = match rest {
            "A" => 2856.0,
            "D50" => 5003.0,
            _ => 6504.0,
        };
        return Ok(if rest == "D65" {
            Vec3::ONE
        } else {
            spectrum::blackbody_rgb(kelvin).unwrap_or(Vec3::ONE)
        });
    }
    if let Some(color) = named(name) {
        return Ok(color);
    }
    let Some(path) = find(name)? else {
        let known = NAMES.iter().copied().chain(GLASSES.iter().map(|(name, _)| *name));
        let error =
            SceneError::new(ErrorKind::Unknown, format!("there is no spectrum `{name}`, nor such a file"));
        return Err(error.at(&param.value_span(0)).maybe_help(did_you_mean(name, known)));
    };
    // A spectrum file: a wavelength and a value a line, # comments.
    let source = crate::source::read(&path, options)?;
    let text = String::from_utf8_lossy(&source.bytes);
    let mut table: Vec<[f64; 2]> = Vec::new();
    let words = text.lines().map(|line| line.split('#').next().unwrap_or_default());
    let mut numbers = words.flat_map(|line| line.split_ascii_whitespace()).map(str::parse::<f64>);
    while let Some(nm) = numbers.next() {
        match (nm, numbers.next()) {
            (Ok(nm), Some(Ok(value))) if nm.is_finite() && value.is_finite() => table.push([nm, value]),
            _ => {
                let error = SceneError::new(ErrorKind::Value, "not a table of wavelengths and values");
                return Err(error.in_file(&path));
            }
        }
    }
    table.sort_by(|a, b| a[0].total_cmp(&b[0]));
    table.dedup_by_key(|row| row[0]);
    if table.is_empty() {
        return Err(SceneError::new(ErrorKind::Value, "no wavelengths in this file").in_file(&path));
    }
    from_table(param, &table, quantity)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reflectance at normal incidence of a metal in vacuum.
    fn reflectance(metal: &str) -> Vec3 {
        let eta = named(&format!("metal-{metal}-eta")).unwrap();
        let k = named(&format!("metal-{metal}-k")).unwrap();
        let k2 = k * k;
        ((eta - 1.0) * (eta - 1.0) + k2) / ((eta + 1.0) * (eta + 1.0) + k2)
    }

    #[test]
    fn metals_have_their_colours() {
        let gold = reflectance("Au");
        assert!(gold.x > 0.9 && gold.y > 0.6 && gold.y < 0.85 && gold.z < 0.5, "{gold}");
        let copper = reflectance("Cu");
        assert!(copper.x > 0.85 && copper.y < 0.75 && copper.z < 0.65, "{copper}");
        assert!(reflectance("Ag").min_element() > 0.94);
        let aluminium = reflectance("Al");
        assert!(aluminium.min_element() > 0.88 && aluminium.max_element() < 0.95, "{aluminium}");
    }

    #[test]
    fn every_listed_name_exists() {
        for name in NAMES {
            let value = named(name).unwrap();
            assert!(value.is_finite() && value.min_element() >= 0.0, "{name} {value}");
        }
        let rutile = named("metal-TiO2-eta").unwrap();
        assert!((rutile.y - 2.65).abs() < 0.05, "{rutile}");
        assert!((named("metal-MgO-eta").unwrap().y - 1.74).abs() < 0.01);
        assert!(named("metal-Xx-eta").is_none() && named("metal-Au-x").is_none());
    }
}
