//! Live view in tev (or any viewer that speaks its protocol) over TCP.
//!
//! A packet is its length (u32, little endian, itself included), a type (u8) and a payload; strings end with
//! a zero byte. Type 4 creates an image, type 6 updates a rectangle of several interleaved channels
//! (facts from tev's own Python client).

use sparing_image::film::{Film, TILE};
use std::io::{self, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

const CREATE_IMAGE: u8 = 4;
const UPDATE_IMAGE: u8 = 6;
const CHANNELS: [&str; 4] = ["R", "G", "B", "SampleCount.Y"];
/// Rows sent in one packet.
const BAND: u32 = 8 * TILE;

/// A connection to a viewer.
#[derive(Debug)]
pub struct Tev {
    stream: TcpStream,
    name: String,
    created: bool,
}

impl Tev {
    /// Connects to `host:port`.
    ///
    /// # Errors
    /// Unknown host, nobody listening.
    pub fn connect(address: &str, name: &str) -> io::Result<Self> {
        let wait = Duration::from_secs(3);
        let mut last = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
        for a in address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&a, wait) {
                Ok(stream) => {
                    stream.set_write_timeout(Some(wait))?;
                    return Ok(Self { stream, name: name.to_owned(), created: false });
                }
                Err(e) => last = e,
            }
        }
        Err(last)
    }

    /// Shows a film.
    ///
    /// # Errors
    /// The viewer went away.
    pub fn update(&mut self, film: &Film) -> io::Result<()> {
        let (w, h) = (film.width(), film.height());
        if !self.created {
            let mut p = Packet::new(CREATE_IMAGE);
            p.bytes(&[1]).string(&self.name).int(w).int(h).channels();
            p.send(&mut self.stream)?;
            self.created = true;
        }
        let pixels = film.map(|t, i| {
            let p = &t.pixels[i];
            let m = p.mean().as_vec3();
            [m.x, m.y, m.z, p.count() as f32]
        });
        for y in (0..h).step_by(BAND as usize) {
            let rows = BAND.min(h - y);
            let mut p = Packet::new(UPDATE_IMAGE);
            p.bytes(&[0]).string(&self.name).channels().int(0).int(y).int(w).int(rows);
            for offset in 0..CHANNELS.len() as i64 {
                p.bytes(&offset.to_le_bytes());
            }
            for _ in CHANNELS {
                p.bytes(&(CHANNELS.len() as i64).to_le_bytes());
            }
            let band = &pixels[y as usize * w as usize..(y + rows) as usize * w as usize];
            for value in band.as_flattened() {
                p.bytes(&value.to_le_bytes());
            }
            p.send(&mut self.stream)?;
        }
        Ok(())
    }
}

struct Packet(Vec<u8>);

impl Packet {
    fn new(kind: u8) -> Self {
        Self(vec![0, 0, 0, 0, kind])
    }

    fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.0.extend_from_slice(bytes);
        self
    }

    fn string(&mut self, text: &str) -> &mut Self {
        self.bytes(text.replace('\0', "").as_bytes()).bytes(&[0])
    }

    fn int(&mut self, value: u32) -> &mut Self {
        self.bytes(&value.to_le_bytes())
    }

    fn channels(&mut self) -> &mut Self {
        self.int(CHANNELS.len() as u32);
        for c in CHANNELS {
            self.string(c);
        }
        self
    }

    fn send(mut self, stream: &mut TcpStream) -> io::Result<()> {
        let length = self.0.len() as u32;
        self.0[..4].copy_from_slice(&length.to_le_bytes());
        stream.write_all(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sparing_image::film::FilmOptions;
    use std::io::Read;
    use std::net::TcpListener;

    /// A viewer of our own reads the packets back.
    #[test]
    fn a_viewer_sees_the_pixels() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address").to_string();
        let viewer = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().expect("a client");
            let mut all = Vec::new();
            stream.read_to_end(&mut all).expect("bytes");
            all
        });
        let mut film = Film::new([10, 70], [0, 0, 10, 70], FilmOptions::default());
        let last = film.tiles.last_mut().expect("a tile");
        let index = last.index(9, 69);
        last.add_sample(index, 0, glam::Vec3::new(1.0, 2.0, 3.0), 1.0);
        Tev::connect(&address, "test").expect("connects").update(&film).expect("sends");
        let bytes = viewer.join().expect("the viewer lives");

        let mut packets = Vec::new();
        let mut rest = &bytes[..];
        while !rest.is_empty() {
            let n = u32::from_le_bytes(rest[..4].try_into().expect("four")) as usize;
            packets.push(&rest[4..n]);
            rest = &rest[n..];
        }
        assert_eq!(packets.len(), 3, "one creation, two bands");
        assert!(
            packets[0].starts_with(b"\x04\x01test\0\x0a\0\0\0\x46\0\0\0\x04\0\0\0R\0G\0B\0SampleCount.Y\0")
        );
        assert!(packets[2].starts_with(b"\x06\0test\0\x04\0\0\0R\0"));
        let floats: Vec<f32> = packets[2][packets[2].len() - 16..]
            .chunks_exact(4)
            .map(|b| f32::from_le_bytes(b.try_into().expect("four")))
            .collect();
        assert_eq!(floats, [1.0, 2.0, 3.0, 1.0]);
    }

    #[test]
    fn nobody_listening_is_an_error() {
        assert!(Tev::connect("127.0.0.1:1", "x").is_err());
        assert!(Tev::connect("no port", "x").is_err());
    }
}
