//! Puts the files in order: at the start, and after the disk has failed.

use super::disk::{DiskError, DiskOperation, DiskOutcome};
use super::{
    Journal, JournalEvent, JournalOutput, RETRY_AFTER_MAX, RETRY_AFTER_MIN, Refused, State, Trouble,
};
use aldis_envelope::Monotonic;

impl Journal {
    /// Begins with the first thing that is to be put in order. False where all is.
    pub(super) fn mend(&mut self, out: &mut JournalOutput) -> bool {
        let Some(operation) = self.mends.get(self.mended) else { return false };
        self.desk.ask(operation.clone(), out);
        self.state = State::Mending;
        true
    }

    pub(super) fn mended(&mut self, now: Monotonic, outcome: DiskOutcome, out: &mut JournalOutput) {
        match outcome {
            Ok(_) => {
                self.mended += 1;
                let last = self.mends.get(self.mended - 1);
                if matches!(last, Some(DiskOperation::Sync { .. } | DiskOperation::Remove { .. })) {
                    self.mends.drain(..self.mended);
                    self.mended = 0;
                }
            }
            Err(why) => {
                // After a sync that failed nobody knows what of it is on disk: it is all done anew.
                self.mended = 0;
                self.fail(now, why, out);
            }
        }
        self.next(out);
    }

    /// The disk has failed: all that waits is refused, and the disk is left alone for a while.
    pub(super) fn fail(&mut self, now: Monotonic, why: DiskError, out: &mut JournalOutput) {
        self.queue.refuse_all(&Refused::Disk(why.clone()), out);
        let wait = match &self.trouble {
            Some(trouble) => (trouble.wait * 2).min(RETRY_AFTER_MAX),
            None => RETRY_AFTER_MIN,
        };
        self.trouble = Some(Trouble { why, retry_at: now + wait, wait, trying: false });
    }

    /// The disk has taken something.
    pub(super) fn has_worked(&mut self, out: &mut JournalOutput) {
        if self.trouble.take().is_some() {
            out.events.push(JournalEvent::Resumed);
        }
    }
}
