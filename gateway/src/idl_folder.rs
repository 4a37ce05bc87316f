//! A folder of IDL, as the node's configuration and `aldis idl` read it.

use aldis_envelope::description::Extensibility;
use aldis_envelope::idl::{self, FILE_BYTES_MAX, Idl, IdlError};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// How deep folders are walked: deeper is a circle of symbolic links.
const DEPTH_MAX: usize = 32;

/// The most files: UMAA 6.0 has some 600.
const FILES_MAX: usize = 20_000;

/// Why a folder was not read.
#[derive(Debug, thiserror::Error)]
pub(crate) enum FolderError {
    /// A file or folder cannot be read.
    #[error("cannot read {}: {why}", path.display())]
    Unreadable {
        /// Which.
        path: PathBuf,
        /// Why.
        why: std::io::Error,
    },
    /// There is no IDL in it.
    #[error("{} holds no file *.idl: give the folder that does", .0.display())]
    Empty(PathBuf),
    /// It is too much.
    #[error("{} holds more than {FILES_MAX} files *.idl, or folders deeper than {DEPTH_MAX}: give the folder of the IDL alone", .0.display())]
    TooMuch(PathBuf),
    /// The files are wrong.
    #[error("{} mistakes in the IDL", .0.len())]
    Wrong(Vec<IdlError>),
}

/// Reads all IDL below a folder, and says how many files there were.
pub(crate) fn read(folder: &Path, default: Extensibility) -> Result<(Idl, usize), FolderError> {
    let mut files = BTreeMap::new();
    collect(folder, folder, 0, &mut files)?;
    if files.is_empty() {
        return Err(FolderError::Empty(folder.to_owned()));
    }
    let idl = idl::parse(&files, default).map_err(FolderError::Wrong)?;
    Ok((idl, files.len()))
}

fn collect(
    root: &Path,
    folder: &Path,
    depth: usize,
    files: &mut BTreeMap<String, String>,
) -> Result<(), FolderError> {
    let unreadable = |path: &Path| {
        let path = path.to_owned();
        move |why| FolderError::Unreadable { path, why }
    };
    for entry in fs::read_dir(folder).map_err(unreadable(folder))? {
        let path = entry.map_err(unreadable(folder))?.path();
        if path.is_dir() {
            if depth >= DEPTH_MAX {
                return Err(FolderError::TooMuch(root.to_owned()));
            }
            collect(root, &path, depth + 1, files)?;
        } else if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("idl")) {
            let bytes = fs::metadata(&path).map_err(unreadable(&path))?.len();
            if files.len() >= FILES_MAX || bytes > FILE_BYTES_MAX as u64 {
                return Err(FolderError::TooMuch(root.to_owned()));
            }
            let bytes = fs::read(&path).map_err(unreadable(&path))?;
            // Comments of old files are in old encodings.
            let text = String::from_utf8_lossy(&bytes).into_owned();
            let name = path.strip_prefix(root).unwrap_or(&path).to_string_lossy().replace('\\', "/");
            files.insert(name, text);
        }
    }
    Ok(())
}
