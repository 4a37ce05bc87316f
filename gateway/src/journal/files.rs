//! The journal's directory.

use aldis_services::journal::{DiskDone, DiskError, DiskOperation, DiskOutcome};
use rustix::fs::{FlockOperation, flock};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{Error, ErrorKind};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

/// Locked while a process uses the journal.
const LOCK: &str = "lock";

/// Why a journal cannot be opened.
#[derive(Debug, thiserror::Error)]
pub(crate) enum JournalError {
    /// Another process uses it.
    #[error(
        "the journal in {0} is used by another process: end it, or give each node a directory of its own"
    )]
    InUse(PathBuf),
    /// Something failed.
    #[error("cannot {what} the journal in {}: {why}", directory.display())]
    Failed {
        /// What could not be done.
        what: &'static str,
        /// Where.
        directory: PathBuf,
        /// What the system says.
        why: String,
    },
}

impl JournalError {
    pub(super) fn new(what: &'static str, directory: &Path, why: &Error) -> Self {
        Self::Failed { what, directory: directory.to_owned(), why: why.to_string() }
    }
}

/// The files of a journal, locked for this process.
pub(super) struct Files {
    path: PathBuf,
    /// Synced where names in it have changed.
    directory: File,
    open: BTreeMap<String, File>,
    /// Unlocks when it is dropped, or when the process ends in whatever way.
    _lock: File,
}

impl Files {
    /// Makes the directory where there is none, and locks it.
    pub(super) fn open(path: &Path) -> Result<Self, JournalError> {
        let failed = |what| move |why: Error| JournalError::new(what, path, &why);
        std::fs::create_dir_all(path).map_err(failed("make the directory of"))?;
        let directory = File::open(path).map_err(failed("open"))?;
        let lock = OpenOptions::new().create(true).truncate(false).write(true).open(path.join(LOCK));
        let lock = lock.map_err(failed("lock"))?;
        match flock(&lock, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => Ok(Self { path: path.to_owned(), directory, open: BTreeMap::new(), _lock: lock }),
            Err(why) if why == rustix::io::Errno::WOULDBLOCK => Err(JournalError::InUse(path.to_owned())),
            Err(why) => Err(JournalError::new("lock", path, &why.into())),
        }
    }

    pub(super) fn carry_out(&mut self, operation: &DiskOperation) -> DiskOutcome {
        match operation {
            DiskOperation::List => self.list().map(DiskDone::Listed).map_err(|why| error("list", "", &why)),
            DiskOperation::Read { file, offset, length } => self
                .read(file, *offset, *length)
                .map(|bytes| DiskDone::Read(bytes.into()))
                .map_err(|why| error("read", file, &why)),
            DiskOperation::Write { file, offset, bytes } => {
                done("write", file, || self.file(file, true)?.write_all_at(bytes, *offset))
            }
            DiskOperation::Sync { file, is_new } => done("sync", file, || {
                self.file(file, false)?.sync_data()?;
                if *is_new { self.directory.sync_all() } else { Ok(()) }
            }),
            DiskOperation::Truncate { file, length } => {
                done("truncate", file, || self.file(file, false)?.set_len(*length))
            }
            DiskOperation::Remove { file } => done("remove", file, || self.remove(file)),
        }
    }

    fn list(&self) -> Result<Vec<(String, u64)>, Error> {
        let mut files = Vec::new();
        for entry in std::fs::read_dir(&self.path)? {
            let entry = entry?;
            let metadata = entry.metadata()?;
            if let (true, Ok(name)) = (metadata.is_file(), entry.file_name().into_string()) {
                files.push((name, metadata.len()));
            }
        }
        Ok(files)
    }

    fn file(&mut self, name: &str, create: bool) -> Result<&File, Error> {
        if !self.open.contains_key(name) {
            let mut options = OpenOptions::new();
            let file = options.read(true).write(true).create(create).open(self.path.join(name))?;
            self.open.insert(name.to_owned(), file);
        }
        self.open.get(name).ok_or_else(|| Error::from(ErrorKind::NotFound))
    }

    fn read(&mut self, name: &str, offset: u64, length: usize) -> Result<Vec<u8>, Error> {
        let file = match self.file(name, false) {
            Err(why) if why.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
            file => file?,
        };
        let left = file.metadata()?.len().saturating_sub(offset);
        let mut bytes = vec![0; length.min(usize::try_from(left).unwrap_or(usize::MAX))];
        file.read_exact_at(&mut bytes, offset)?;
        Ok(bytes)
    }

    fn remove(&mut self, name: &str) -> Result<(), Error> {
        self.open.remove(name);
        match std::fs::remove_file(self.path.join(name)) {
            Err(why) if why.kind() != ErrorKind::NotFound => Err(why),
            _ => self.directory.sync_all(),
        }
    }
}

fn done(what: &str, file: &str, act: impl FnOnce() -> Result<(), Error>) -> DiskOutcome {
    act().map(|()| DiskDone::Done).map_err(|why| error(what, file, &why))
}

fn error(what: &str, file: &str, why: &Error) -> DiskError {
    let text = format!("{what} {file}: {why}");
    match why.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => DiskError::Full(text),
        _ => DiskError::Failed(text),
    }
}
