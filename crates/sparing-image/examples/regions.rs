//! Mean colours of parts of a picture and of a reference, and how far they are apart:
//!
//!     cargo run --release -p sparing-image --example regions -- OURS.exr REFERENCE.exr [NAME=X0,Y0,X1,Y1]...

use sparing_image::picture::Picture;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [ours, reference, regions @ ..] = &arguments[..] else {
        return Err("usage: regions OURS REFERENCE [NAME=X0,Y0,X1,Y1]...".into());
    };
    let pictures = [ours, reference].map(|name| Picture::read(Path::new(name)));
    let [ours, reference] = pictures;
    let (ours, reference) = (ours?, reference?);
    let (width, height) = (ours.width as usize, ours.height as usize);
    if (reference.width as usize, reference.height as usize) != (width, height) {
        return Err("the pictures differ in size".into());
    }
    let all = format!("all=0,0,{width},{height}");
    println!("{:<12} {:>30} {:>30} {:>9}", "region", "ours", "reference", "more");
    for region in std::iter::once(&all).chain(regions) {
        let (name, numbers) = region.split_once('=').ok_or("a region is NAME=X0,Y0,X1,Y1")?;
        let numbers: Result<Vec<usize>, _> = numbers.split(',').map(str::parse).collect();
        let [x0, y0, x1, y1] = numbers?[..] else { return Err("a region is NAME=X0,Y0,X1,Y1".into()) };
        if x0 >= x1 || y0 >= y1 || x1 > width || y1 > height {
            return Err(format!("{name} is not within {width}x{height}").into());
        }
        let mean = |picture: &Picture| {
            let pixels = picture.to_linear();
            let mut sum = [0.0f64; 3];
            for y in y0..y1 {
                for pixel in &pixels[y * width + x0..y * width + x1] {
                    sum.iter_mut().zip(pixel).for_each(|(s, v)| *s += f64::from(*v));
                }
            }
            sum.map(|s| s / ((x1 - x0) * (y1 - y0)) as f64)
        };
        let (a, b) = (mean(&ours), mean(&reference));
        let more = (a.iter().sum::<f64>() / b.iter().sum::<f64>() - 1.0) * 100.0;
        println!("{name:<12} {:>30} {:>30} {more:>+8.2}%", show(a), show(b));
    }
    Ok(())
}

fn show(color: [f64; 3]) -> String {
    color.map(|c| format!("{c:.4}")).join(" ")
}
