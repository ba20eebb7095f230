//! Files beside a scene that it names itself: only regular files inside the scene's folder are read.

use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// At most `limit` bytes of the file that a scene in `folder` calls `name`.
///
/// # Errors
/// A sentence, without the name: the file is missing, lies outside the folder, is no regular file, is longer than
/// `limit` or cannot be read.
pub(super) fn read_neighbour(folder: &Path, name: &str, limit: u64) -> Result<Vec<u8>, String> {
    let path = find(folder, name)?;
    let read = || -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let file = std::fs::File::open(&path)?;
        file.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
        Ok(bytes)
    };
    let bytes = read().map_err(|error| error.to_string())?;
    if bytes.len() as u64 > limit {
        return Err(format!("found more than {limit} bytes"));
    }
    Ok(bytes)
}

/// Where the file is, after symbolic links and `..`.
fn find(folder: &Path, name: &str) -> Result<PathBuf, String> {
    let folder = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    let resolve = |path: &Path| path.canonicalize().map_err(|error| error.to_string());
    let folder = resolve(folder)?;
    let path = resolve(&folder.join(name))?;
    if !path.starts_with(&folder) {
        return Err("only files inside the scene's folder are read".to_owned());
    }
    // Opening anything else, such as a named pipe, may wait for ever.
    if !path.is_file() {
        return Err("expected a regular file".to_owned());
    }
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_inside_the_folder_are_read() {
        let outer = tempfile::tempdir().expect("a folder");
        let folder = outer.path().join("scene");
        std::fs::create_dir_all(folder.join("sub")).expect("writable");
        std::fs::write(outer.path().join("secret"), b"s").expect("writable");
        std::fs::write(folder.join("sub/a b.bin"), b"abc").expect("writable");
        let read = |name: &str, limit| read_neighbour(&folder, name, limit);
        assert_eq!(read("sub/a b.bin", 3), Ok(b"abc".to_vec()));
        assert_eq!(read("sub/../sub/a b.bin", 3), Ok(b"abc".to_vec()));
        let absolute = outer.path().join("secret");
        let absolute = absolute.to_str().expect("a name of text");
        for (name, limit, reason) in [
            ("sub/a b.bin", 2, "more than 2 bytes"),
            ("../secret", 9, "inside the scene's folder"),
            (absolute, 9, "inside the scene's folder"),
            ("sub", 9, "a regular file"),
            ("", 9, "a regular file"),
            ("none", 9, "No such file"),
        ] {
            let found = read(name, limit).expect_err(name);
            assert!(found.contains(reason), "{name}: {found}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_do_not_lead_outside() {
        let outer = tempfile::tempdir().expect("a folder");
        let folder = outer.path().join("scene");
        std::fs::create_dir(&folder).expect("writable");
        std::fs::write(outer.path().join("secret"), b"s").expect("writable");
        std::os::unix::fs::symlink("../secret", folder.join("link")).expect("a link");
        let found = read_neighbour(&folder, "link", 9).expect_err("refused");
        assert!(found.contains("inside the scene's folder"), "{found}");
    }
}
