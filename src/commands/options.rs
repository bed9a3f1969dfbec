//! Parsers of option values.

use std::time::Duration;

/// `WxH`.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let (w, h) = text.split_once(['x', 'X']).ok_or("expected WIDTHxHEIGHT, such as 640x360")?;
    let side = |s: &str| s.trim().parse::<u32>().map_err(|_| format!("'{s}' is not a number of pixels"));
    let (w, h) = (side(w)?, side(h)?);
    check_size(w, h)?;
    Ok([w, h])
}

/// Largest side and number of pixels of a picture.
pub const MAX_SIDE: u32 = 65_536;
const MAX_PIXELS: u64 = 1 << 30;

/// Whether a picture of this size can be rendered.
pub fn check_size(w: u32, h: u32) -> Result<(), String> {
    if w == 0 || h == 0 {
        return Err(format!("a picture of {w}x{h} has no pixels"));
    }
    if w > MAX_SIDE || h > MAX_SIDE || u64::from(w) * u64::from(h) > MAX_PIXELS {
        return Err(format!(
            "a picture of {w}x{h} is too large: at most {MAX_SIDE} a side and {MAX_PIXELS} pixels"
        ));
    }
    Ok(())
}

/// `x0,y0,x1,y1`, end exclusive.
pub fn crop(text: &str) -> Result<[u32; 4], String> {
    let values: Result<Vec<u32>, _> = text.split(',').map(|s| s.trim().parse()).collect();
    let values = values.map_err(|_| "expected four pixel positions x0,y0,x1,y1".to_owned())?;
    let [x0, y0, x1, y1] = values[..] else { return Err("expected four pixel positions x0,y0,x1,y1".into()) };
    if x0 >= x1 || y0 >= y1 {
        return Err(format!("the crop {text} is empty: x0 < x1 and y0 < y1 are needed"));
    }
    Ok([x0, y0, x1, y1])
}

/// `I/N`, I from 1.
pub fn shard(text: &str) -> Result<[u32; 2], String> {
    let parts =
        text.split_once('/').and_then(|(i, n)| Some([i.trim().parse().ok()?, n.trim().parse().ok()?]));
    match parts {
        Some([index, count]) if (1..=count).contains(&index) && count <= MAX_SHARDS => Ok([index, count]),
        Some([index, count]) => {
            Err(format!("there is no part {index} of {count}: parts count from 1, up to {MAX_SHARDS}"))
        }
        None => Err("expected I/N, such as 2/8".into()),
    }
}

/// Most parts of a picture.
const MAX_SHARDS: u32 = 65_536;

/// A threshold in just noticeable differences for one sample.
pub fn lambda(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(l) if l > 0.0 && l.is_finite() => Ok(l),
        Ok(_) => Err("a threshold is above 0 and finite".into()),
        Err(_) => Err(format!("'{text}' is not a number")),
    }
}

/// `x,y`.
pub fn pixel(text: &str) -> Result<[u32; 2], String> {
    let (x, y) = text.split_once(',').ok_or("expected a pixel x,y")?;
    let side = |s: &str| s.trim().parse::<u32>().map_err(|_| format!("'{s}' is not a pixel position"));
    Ok([side(x)?, side(y)?])
}

/// A hundred years.
const MAX_DURATION: Duration = Duration::from_secs(100 * 365 * 24 * 3600);

/// `90`, `30s`, `5m`, `1.5h`.
pub fn duration(text: &str) -> Result<Duration, String> {
    let split = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let value: f64 =
        number.trim().parse().map_err(|_| format!("'{text}' is not a duration such as 30s or 5m"))?;
    let factor = match unit {
        "" | "s" => 1.0,
        "ms" => 1e-3,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(format!("'{unit}' is not a unit of time: use ms, s, m or h")),
    };
    match Duration::try_from_secs_f64(value * factor) {
        Ok(d) if d.is_zero() => Err("no time at all would render nothing".into()),
        Ok(d) if d <= MAX_DURATION => Ok(d),
        _ => Err(format!("'{text}' is not a duration that can be waited for")),
    }
}

/// A number of threads; 0 is all. Thousands are a slip that would bring the machine to its knees.
pub fn threads(text: &str) -> Result<usize, String> {
    match text.parse::<usize>() {
        Ok(n @ 0..=1024) => Ok(n),
        Ok(n) => Err(format!("{n} threads are too many: use at most 1024, or 0 for one a core")),
        Err(_) => Err(format!("'{text}' is not a number of threads")),
    }
}

/// A number of samples per pixel.
pub fn spp(text: &str) -> Result<u32, String> {
    match text.parse::<u32>() {
        Ok(n @ 1..=1_048_576) => Ok(n),
        Ok(n) => Err(format!("{n} samples per pixel are not possible: use 1 to 1048576")),
        Err(_) => Err(format!("'{text}' is not a number of samples")),
    }
}

/// A tolerance in just noticeable differences.
pub fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(t) if t > 0.0 && t.is_finite() => Ok(t),
        Ok(_) => Err("a tolerance is above 0 and finite: 1 is one just noticeable difference".into()),
        Err(_) => Err(format!("'{text}' is not a number")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_parse_or_say_why_not() {
        assert_eq!(size("640x360"), Ok([640, 360]));
        for bad in ["0x10", "100000x100000", "640", "-1x5", "ax5", "65536x65536", ""] {
            assert!(size(bad).is_err(), "{bad}");
        }
        assert_eq!(crop("1,2,3,4"), Ok([1, 2, 3, 4]));
        for bad in ["1,2,1,4", "1,2,3", "1,2,3,4,5", "a,b,c,d", "-1,0,5,5"] {
            assert!(crop(bad).is_err(), "{bad}");
        }
        assert_eq!(duration("1.5m"), Ok(Duration::from_secs(90)));
        assert_eq!(duration("250ms"), Ok(Duration::from_millis(250)));
        for bad in ["", "s", "-3s", "5y", "nan", "inf", "0", "0ms", "1000000000000000h"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
        assert!(spp("0").is_err() && spp("-1").is_err() && spp("1.5").is_err() && spp("9999999").is_err());
        assert_eq!(spp("64"), Ok(64));
        assert!(threads("100000").is_err() && threads("-1").is_err() && threads("two").is_err());
        assert_eq!(threads("0"), Ok(0));
    }
}
