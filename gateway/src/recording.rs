//! The files of a recorder.

use crate::clock;
use aldis_services::recorder::{Piece, Write};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, create_dir_all};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Files that are written piece by piece, in the order of the numbers.
struct Files {
    directory: PathBuf,
    /// In every name, so that no run meets the files of another.
    since_ms: i64,
    made: u64,
    /// The number of the piece that is next.
    next: u64,
    /// Pieces that came before their turn.
    early: BTreeMap<u64, Piece>,
    file: Option<File>,
}

/// What writes pieces into files of a directory, which is made with the first of them.
pub(crate) fn writer(directory: &Path) -> Write {
    let files = Files {
        directory: directory.to_owned(),
        since_ms: clock::wall().0 / 1_000_000,
        made: 0,
        next: 0,
        early: BTreeMap::new(),
        file: None,
    };
    let files = Mutex::new(files);
    Arc::new(move |piece| {
        // A panic while writing leaves at worst a torn record, which readers tell.
        files.lock().unwrap_or_else(PoisonError::into_inner).take(piece)
    })
}

impl Files {
    fn take(&mut self, piece: &Piece) -> Result<(), String> {
        if piece.number == 0 {
            // The service has been started again.
            self.early.clear();
            self.next = 0;
        }
        self.early.insert(piece.number, piece.clone());
        let mut result = Ok(());
        while let Some(piece) = self.early.remove(&self.next) {
            self.next += 1;
            result = result.and(self.write(&piece));
        }
        result
    }

    fn write(&mut self, piece: &Piece) -> Result<(), String> {
        if piece.begins {
            self.file = None;
            self.file = Some(self.begin()?);
        }
        let Some(file) = &mut self.file else { return Err("its file could not be made".into()) };
        let written = file.write_all(&piece.bytes);
        if written.is_err() {
            self.file = None;
        }
        written.map_err(|why| format!("{}: {why}", self.directory.display()))
    }

    fn begin(&mut self) -> Result<File, String> {
        let name = self.directory.join(format!("record-{}-{:06}.aldis", self.since_ms, self.made));
        self.made += 1;
        let open = || OpenOptions::new().create_new(true).append(true).open(&name);
        create_dir_all(&self.directory)
            .and_then(|()| open())
            .map_err(|why| format!("{}: {why}", name.display()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A directory that is gone with the test.
    struct Place(PathBuf);

    impl Place {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("aldis-recording-{}-{name}", std::process::id()));
            create_dir_all(&path).unwrap();
            Self(path)
        }
    }

    impl Drop for Place {
        fn drop(&mut self) {
            let _ = std::fs::remove_dir_all(&self.0);
        }
    }

    fn piece(number: u64, begins: bool, text: &str) -> Piece {
        Piece { number, begins, bytes: text.as_bytes().to_vec() }
    }

    /// What the files hold, in the order of their names.
    fn contents(directory: &Path) -> Vec<String> {
        let mut paths: Vec<_> =
            std::fs::read_dir(directory).unwrap().map(|entry| entry.unwrap().path()).collect();
        paths.sort();
        paths.iter().map(|path| std::fs::read_to_string(path).unwrap()).collect()
    }

    #[test]
    fn pieces_are_written_in_the_order_of_their_numbers() {
        let place = Place::new("order");
        let directory = place.0.join("made");
        let write = writer(&directory);
        for piece in [piece(0, true, "a"), piece(2, true, "c"), piece(1, false, "b"), piece(3, false, "d")] {
            write(&piece).unwrap();
        }
        assert_eq!(contents(&directory), ["ab", "cd"]);
        write(&piece(0, true, "again")).unwrap();
        assert_eq!(contents(&directory), ["ab", "cd", "again"]);
    }

    #[test]
    fn a_directory_that_cannot_be_made_is_named() {
        let place = Place::new("file");
        std::fs::write(place.0.join("file"), "").unwrap();
        let write = writer(&place.0.join("file"));
        let why = write(&piece(0, true, "a")).unwrap_err();
        assert!(why.contains("file/record-"), "{why}");
        assert!(write(&piece(1, false, "b")).is_err());
    }
}
