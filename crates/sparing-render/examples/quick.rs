use sparing_image::film::{Film, FilmOptions};
use sparing_render::integrator::Wave;
use sparing_render::{BuildOptions, RenderSettings, Renderer, Scene};
use std::path::Path;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let mut d = sparing_scene::load(Path::new(&a[1])).map_err(|e| eprintln!("{e}")).unwrap();
    let spp: u32 = a[3].parse().unwrap();
    if let Some(w) = a.get(4) { d.film.width = w.parse().unwrap(); d.film.height = a[5].parse().unwrap(); }
    for w in &d.warnings { eprintln!("warning: {w}"); }
    let settings = RenderSettings { max_depth: d.integrator.max_depth, ..Default::default() };
    let size = [d.film.width, d.film.height];
    let robust = std::env::var("ROBUST").is_ok();
    let t = std::time::Instant::now();
    let scene = Scene::build(d, BuildOptions { robust, ..Default::default() }).unwrap();
    eprintln!("build {:?} needs {:?} {:?}", t.elapsed(), scene.needs().names(), scene.statistics);
    let mut film = Film::new(size, [0, 0, size[0], size[1]], FilmOptions::default());
    let r = Renderer::new(&scene, settings, FilmOptions::default());
    for _ in 0..3 {
        film = Film::new(size, [0, 0, size[0], size[1]], FilmOptions::default());
        let t = std::time::Instant::now();
        let mut wave = Wave { target: spp, ..Default::default() };
        let s = r.run(&mut film, &wave, |_, _| true);
        let e = t.elapsed().as_secs_f64();
        let rays = s.camera + s.bounce + s.shadow;
        eprintln!("{e:.3} s, {:.2} M samples/s, {:.2} M rays/s, {s:?} invalid {}", film.samples() as f64 / e / 1e6, rays as f64 / e / 1e6, film.invalid_samples());
        wave.target = 0;
    }
    let b = film.beauty();
    let mut img = image::RgbImage::new(size[0], size[1]);
    for (p, v) in img.pixels_mut().zip(&b) {
        for k in 0..3 {
            let x = v[k].clamp(0.0, 1.0);
            let s = if x <= 0.0031308 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
            p.0[k] = (s * 255.0 + 0.5) as u8;
        }
    }
    img.save(&a[2]).unwrap();
}
