//! A file appears complete or not at all.

use std::error::Error;
use std::fs;
use std::io::Write;
use std::path::Path;

use sparing_image::atomic::{AtomicFile, OutputError, check_writable, write_atomic};
use sparing_image::exr::{ExrImage, write_exr};

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn a_commit_replaces_and_a_drop_leaves_nothing() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("a.txt");
    let mut file = AtomicFile::create(&path)?;
    file.write_all(b"one")?;
    assert!(!path.exists());
    file.commit()?;
    assert_eq!(fs::read(&path)?, b"one");

    let mut file = AtomicFile::create(&path)?;
    file.write_all(b"two")?;
    drop(file);
    assert_eq!(fs::read(&path)?, b"one");
    assert_eq!(names(folder.path()), ["a.txt"]);
    Ok(())
}

#[test]
fn an_error_while_writing_keeps_the_old_file() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("a.txt");
    fs::write(&path, "old")?;
    let result = write_atomic(&path, |file| {
        file.write_all(&[7; 1 << 20]).map_err(OutputError::io(&path))?;
        Err(OutputError::io(&path)(std::io::ErrorKind::StorageFull.into()))
    });
    let message = result.unwrap_err().to_string();
    assert!(message.contains("a.txt") && message.contains("no storage space"), "{message}");
    assert_eq!(fs::read(&path)?, b"old");
    assert_eq!(names(folder.path()), ["a.txt"]);
    Ok(())
}

#[test]
fn files_written_at_once_do_not_mix() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("a.txt");
    let mut first = AtomicFile::create(&path)?;
    let mut second = AtomicFile::create(&path)?;
    first.write_all(b"first")?;
    second.write_all(b"second")?;
    second.commit()?;
    first.commit()?;
    assert_eq!(fs::read(&path)?, b"first");
    assert_eq!(names(folder.path()), ["a.txt"]);
    Ok(())
}

#[test]
fn hopeless_paths_are_refused_early() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path();
    assert!(check_writable(path).is_err());
    let message = check_writable(&path.join("no/such/a.exr")).unwrap_err().to_string();
    assert!(message.contains("no/such/a.exr"), "{message}");
    assert!(check_writable(Path::new("")).is_err());
    assert!(check_writable(Path::new("/")).is_err());
    check_writable(&path.join("a.exr"))?;
    fs::write(path.join("b.exr"), "old")?;
    check_writable(&path.join("b.exr"))?;
    assert_eq!(names(path), ["b.exr"]);
    assert_eq!(fs::read(path.join("b.exr"))?, b"old");
    Ok(())
}

#[test]
fn a_refused_image_leaves_no_file() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("a.exr");
    let mut image = ExrImage::new(2, 2);
    image.push("Y", vec![0.0; 3]);
    let message = write_exr(&path, &image).unwrap_err().to_string();
    assert!(message.contains("3 values for 4 pixels"), "{message}");
    assert!(names(folder.path()).is_empty());
    Ok(())
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_one_clear_error() {
    let mut image = ExrImage::new(64, 64);
    image.push("Y", (0..64 * 64).map(|i| (i as f32).sin()).collect());
    let message = write_exr(Path::new("/dev/full"), &image).unwrap_err().to_string();
    assert!(message.starts_with("cannot write /dev/full: No space left on device"), "{message}");
    write_exr(Path::new("/dev/null"), &image).unwrap();
}

#[cfg(unix)]
#[test]
fn links_are_followed() -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let (real, link) = (folder.path().join("real"), folder.path().join("link"));
    fs::write(&real, "old")?;
    std::os::unix::fs::symlink(&real, &link)?;
    write_atomic(&link, |file| file.write_all(b"new").map_err(OutputError::io(&link)))?;
    assert_eq!(fs::read(&real)?, b"new");
    assert!(fs::symlink_metadata(&link)?.is_symlink());
    Ok(())
}
