//! `Camera`, `Film`, `PixelFilter`, `Sampler` and `Integrator`.

use super::Builder;
use super::dialect::Dialect;
use super::graphics_state::invert;
use super::params::{ParamList, ParamType};
use crate::description::{PixelFilter, Projection, SamplerKind};
use crate::error::{ErrorKind, SceneError, did_you_mean};
use crate::source::Span;

/// Pixels along one axis of a film.
const MAX_RESOLUTION: i32 = 65_536;

impl Builder<'_> {
    /// `Camera "type" parameters`; the camera's space is where the current transformation puts it.
    pub(super) fn camera(&mut self, ty: &str, at: &Span, params: &ParamList) -> Result<(), SceneError> {
        let Some(camera_to_world) = invert(self.state.ctm) else {
            let error = SceneError::new(ErrorKind::Value, "the camera's transformation cannot be inverted");
            return Err(error.at(at));
        };
        let Some(end) = invert(self.state.ctm_end) else {
            let error = SceneError::new(ErrorKind::Value, "the camera's transformation cannot be inverted");
            return Err(error.at(at));
        };
        self.coordinate_systems.insert("camera".to_owned(), [camera_to_world, end]);
        let camera = &mut self.scene.camera;
        camera.camera_to_world = camera_to_world.as_mat4();
        camera.end = self.state.end().map(|_| end.as_mat4());
        camera.projection = match ty {
            "perspective" => {
                let inside = |fov: f32| fov > 0.0 && fov < 180.0;
                // `halffov` is of version 2.
                let half =
                    params.float_where("halffov", 45.0, "between 0 and 90", |h| h > 0.0 && h < 90.0)?;
                Projection::Perspective {
                    fov: params.float_where("fov", 2.0 * half, "between 0 and 180", inside)?,
                }
            }
            "orthographic" => Projection::Orthographic,
            // `environment` is of versions 2 and 3.
            "environment" => Projection::Equirectangular,
            "spherical" => match params.string("mapping")? {
                None | Some(("equalarea", _)) => Projection::EqualArea,
                Some(("equirectangular", _)) => Projection::Equirectangular,
                Some((name, param)) => {
                    let error = param.value_error(0, format!("there is no mapping `{name}`"));
                    return Err(error.help("mappings of spherical cameras are equalarea and equirectangular"));
                }
            },
            "realistic" => {
                let lens = params.string("lensfile")?.map_or("", |(name, _)| name);
                let fov = fov_of_lens(focal_length(lens).unwrap_or(50.0));
                let focus = params.float_where("focusdistance", 10.0, "positive", |d| d > 0.0)?;
                params.ignore(&["aperturediameter", "aperture"]);
                let message = format!(
                    "realistic cameras are not supported: a pinhole of {fov:.1} degrees stands in, the lens named by its file"
                );
                self.warnings.at(at, message);
                camera.focal_distance = focus;
                Projection::Perspective { fov }
            }
            other => {
                let error = SceneError::new(ErrorKind::Unknown, format!("there is no camera type `{other}`"));
                let known = ["perspective", "orthographic", "spherical"];
                let help = did_you_mean(other, known);
                return Err(error
                    .at(at)
                    .help("supported are perspective, orthographic and spherical")
                    .maybe_help(help));
            }
        };
        camera.lens_radius = params.float_where("lensradius", 0.0, "not negative", |r| r >= 0.0)?;
        if ty != "realistic" {
            camera.focal_distance = params.float_where("focaldistance", 1e6, "positive", |d| d > 0.0)?;
        }
        camera.screen_window = match params.groups("screenwindow", &[ParamType::Float], 1)? {
            None => None,
            Some((_, &[x0, x1, y0, y1])) if x0 < x1 && y0 < y1 => Some([x0, x1, y0, y1]),
            Some((param, _)) => {
                return Err(param.error("`screenwindow` takes 4 numbers: x0 < x1, then y0 < y1"));
            }
        };
        if params.get("frameaspectratio").is_some() {
            let aspect = params.float_where("frameaspectratio", 1.0, "positive", |a| a > 0.0)?;
            let (x, y) = if aspect > 1.0 { (aspect, 1.0) } else { (1.0, 1.0 / aspect) };
            camera.screen_window.get_or_insert([-x, x, -y, y]);
        }
        let [open, close] = [("shutteropen", 0.0), ("shutterclose", 1.0)].map(|(name, default)| {
            let value = params.float(name);
            value.map(|value| value.unwrap_or(default))
        });
        let (mut open, mut close) = (open?, close?);
        if open > close {
            self.warnings.at(at, "the shutter closes before it opens: the two times are exchanged");
            (open, close) = (close, open);
        }
        camera.shutter = [open, close];
        params.ignore(&["hither", "yon"]);
        params.warn_unused("the camera", &mut self.warnings);
        self.has_camera = true;
        Ok(())
    }

    /// `Film "type" parameters`.
    pub(super) fn film(&mut self, ty: &str, at: &Span, params: &ParamList) -> Result<(), SceneError> {
        if !["rgb", "gbuffer", "spectral", "image"].contains(&ty) {
            let error = SceneError::new(ErrorKind::Unknown, format!("there is no film type `{ty}`"));
            return Err(error.at(at).help("known are rgb, gbuffer and spectral"));
        }
        let film = &mut self.scene.film;
        let pixels = |value: Option<i32>| value.map(|v| v.unsigned_abs());
        let [width, height] = default_size(self.dialect);
        film.width = pixels(params.integer_in("xresolution", 1..=MAX_RESOLUTION)?).unwrap_or(width);
        film.height = pixels(params.integer_in("yresolution", 1..=MAX_RESOLUTION)?).unwrap_or(height);
        film.filename = params.string("filename")?.map(|(name, _)| name.to_owned());
        let (width, height) = (film.width, film.height);
        let mut crop = None;
        if let Some((param, window)) = params.groups("cropwindow", &[ParamType::Float], 1)? {
            let &[x0, x1, y0, y1] = window else {
                return Err(param.error("`cropwindow` takes 4 numbers from 0 to 1: x0 x1 y0 y1"));
            };
            let pixel = |share: f32, size: u32| (share.clamp(0.0, 1.0) * size as f32).ceil() as u32;
            let bounds = [pixel(x0, width), pixel(y0, height), pixel(x1, width), pixel(y1, height)];
            crop = Some((param, bounds));
        }
        if let Some((param, bounds)) = params.integers("pixelbounds")? {
            let &[x0, x1, y0, y1] = bounds else {
                return Err(param.error("`pixelbounds` takes 4 integers: x0 x1 y0 y1"));
            };
            let clamp = |value: i32, size: u32| value.max(0).unsigned_abs().min(size);
            let bounds = [clamp(x0, width), clamp(y0, height), clamp(x1, width), clamp(y1, height)];
            crop = Some((param, bounds));
        }
        if let Some((param, [x0, y0, x1, y1])) = crop {
            if x0 >= x1 || y0 >= y1 {
                return Err(param.error("the part of the picture to render is empty"));
            }
            film.crop = Some([x0, y0, x1, y1]);
        }
        let iso = params.float_where("iso", 100.0, "positive", |v| v > 0.0)?;
        let exposure = params.float_where("exposuretime", 1.0, "positive", |v| v > 0.0)?;
        // `scale` is of version 3.
        let scale = params.float_where("scale", 1.0, "not negative", |v| v >= 0.0)?;
        film.scale = scale * exposure * iso / 100.0;
        if let Some((sensor, param)) = params.string("sensor")?
            && sensor != "cie1931"
        {
            self.warnings.at(&param.span, format!("sensor `{sensor}` is not modelled: cie1931 instead"));
        }
        if let Some(limit) = params.get("maxcomponentvalue").or_else(|| params.get("maxsampleluminance")) {
            self.warnings.at(&limit.span, "samples are not clamped: bright ones count in full");
        }
        params.ignore(&["diagonal", "savefp16", "coordinatesystem", "premultiplyalpha", "display"]);
        params.warn_unused("the film", &mut self.warnings);
        Ok(())
    }

    /// `PixelFilter "type" parameters`.
    pub(super) fn pixel_filter(&mut self, ty: &str, at: &Span, params: &ParamList) -> Result<(), SceneError> {
        let radius = |default: f32| -> Result<[f32; 2], SceneError> {
            // `xwidth` and `ywidth` are radii, too: the names before version 4.
            let axis = |name: &str, old: &str| {
                let name = if params.get(old).is_some() { old } else { name };
                params.float_where(name, default, "above 0 and at most 32", |r| r > 0.0 && r <= 32.0)
            };
            Ok([axis("xradius", "xwidth")?, axis("yradius", "ywidth")?])
        };
        self.scene.filter = match ty {
            "box" => PixelFilter::Box { radius: radius(0.5)? },
            "triangle" => PixelFilter::Triangle { radius: radius(2.0)? },
            "gaussian" => {
                let old = self.dialect != Dialect::V4;
                // exp(-alpha x²) before version 4.
                let alpha = params.float_where("alpha", 2.0, "positive", |a| a > 0.0)?;
                let sigma = (0.5 / alpha).sqrt();
                PixelFilter::Gaussian {
                    radius: radius(if old { 2.0 } else { 1.5 })?,
                    sigma: params.float_where("sigma", sigma, "positive", |s| s > 0.0)?,
                }
            }
            "mitchell" => PixelFilter::Mitchell {
                radius: radius(2.0)?,
                b: params.float("B")?.unwrap_or(1.0 / 3.0),
                c: params.float("C")?.unwrap_or(1.0 / 3.0),
            },
            "blackmanharris" => PixelFilter::BlackmanHarris { radius: radius(2.0)? },
            "sinc" => {
                params.ignore(&["tau"]);
                self.warnings.at(at, "the sinc filter is replaced by Blackman-Harris of the same radius");
                PixelFilter::BlackmanHarris { radius: radius(4.0)? }
            }
            other => {
                let known = ["box", "triangle", "gaussian", "mitchell", "blackmanharris", "sinc"];
                let error =
                    SceneError::new(ErrorKind::Unknown, format!("there is no pixel filter `{other}`"));
                let help = "known are: ".to_owned() + &known.join(", ");
                return Err(error.at(at).help(help).maybe_help(did_you_mean(other, known)));
            }
        };
        params.warn_unused("the pixel filter", &mut self.warnings);
        Ok(())
    }

    /// `Sampler "type" parameters`.
    pub(super) fn sampler(&mut self, ty: &str, at: &Span, params: &ParamList) -> Result<(), SceneError> {
        let sampler = &mut self.scene.sampler;
        sampler.kind = match ty {
            "sobol" | "zsobol" | "paddedsobol" => SamplerKind::Sobol,
            "independent" | "random" => SamplerKind::Independent,
            "halton" | "stratified" | "pmj02bn" | "lowdiscrepancy" | "02sequence" | "maxmindist"
            | "bestcandidate" | "adaptive" => {
                self.warnings.at(at, format!("sampler `{ty}` is replaced by Owen-scrambled Sobol"));
                SamplerKind::Sobol
            }
            other => {
                let known =
                    ["sobol", "zsobol", "paddedsobol", "independent", "halton", "stratified", "pmj02bn"];
                let error = SceneError::new(ErrorKind::Unknown, format!("there is no sampler `{other}`"));
                let help = "known are: ".to_owned() + &known.join(", ");
                return Err(error.at(at).help(help).maybe_help(did_you_mean(other, known)));
            }
        };
        let samples = params.integer_in("pixelsamples", 1..=1 << 24)?.map(i32::unsigned_abs);
        let x = params.integer_in("xsamples", 1..=4096)?;
        let y = params.integer_in("ysamples", 1..=4096)?;
        let grid = (x.is_some() || y.is_some()).then(|| (x.unwrap_or(4) * y.unwrap_or(4)).unsigned_abs());
        sampler.spp = samples.or(grid);
        sampler.seed = params.integer("seed")?.map_or(0, |seed| u64::from(seed as u32));
        // An adaptive sampler of version 2 ends at `maxsamples`.
        let most = params.integer_in("maxsamples", 1..=1 << 24)?.map(i32::unsigned_abs);
        sampler.spp = sampler.spp.or(most);
        params.ignore(&[
            "randomization",
            "jitter",
            "dimensions",
            "minsamples",
            "method",
            "samplepixelcenter",
        ]);
        params.warn_unused("the sampler", &mut self.warnings);
        Ok(())
    }

    /// `Integrator "type" parameters`; every one becomes the path tracer.
    pub(super) fn integrator(&mut self, ty: &str, at: &Span, params: &ParamList) -> Result<(), SceneError> {
        if !["path", "volpath", "simplepath", "simplevolpath"].contains(&ty) {
            let short = super::parser::shorten(ty);
            self.warnings.at(at, format!("integrator `{short}` is replaced by the path tracer"));
            params.params.iter().for_each(|param| param.used.set(true));
        }
        let depth = params.integer_in("maxdepth", 0..=1_000_000)?.map_or(5, i32::unsigned_abs);
        // Paths of version 2 gather light once more where they end.
        let more = u32::from(self.dialect == Dialect::V2 && ty == "path");
        self.scene.integrator.max_depth = depth + more;
        params.ignore(&[
            "lightsampler",
            "lightsamplestrategy",
            "regularize",
            "samplelights",
            "samplebsdf",
            "rrthreshold",
            "pixelbounds",
        ]);
        params.warn_unused("the integrator", &mut self.warnings);
        Ok(())
    }
}

/// Focal length in mm that the name of a lens file ends on, as in `wide.22mm.dat`.
fn focal_length(file: &str) -> Option<f32> {
    let length = file.strip_suffix(".dat")?.strip_suffix("mm")?.rsplit('.').next()?;
    length.parse().ok().filter(|mm: &f32| *mm > 0.0 && mm.is_finite())
}

/// Degrees that the shorter side of a 16:9 film of pbrt's 35 mm across is seen under.
fn fov_of_lens(mm: f32) -> f32 {
    let half_side = 35.0 * 9.0 / 337f32.sqrt() / 2.0;
    2.0 * (half_side / mm).atan().to_degrees()
}

/// Size of the picture where a scene does not say it.
pub(super) fn default_size(dialect: Dialect) -> [u32; 2] {
    if dialect == Dialect::V4 { [1280, 720] } else { [640, 480] }
}
