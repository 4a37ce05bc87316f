use super::*;
use crate::service::Action;
use aldis_envelope::codec::recording::Reader;
use aldis_envelope::{
    BootId, ContentType, EntityId, Label, Message, Name, Priority, ServiceId, Source, Stamp, Wall,
};
use std::sync::Mutex;

fn source() -> Source {
    Source::new(EntityId::new(400).unwrap(), ServiceId::new(100).unwrap())
}

fn now(ms: u64) -> Now {
    Now { monotonic: Monotonic::since_start(Duration::from_millis(ms)), wall: Wall(5) }
}

fn envelope(sequence: u64, bytes: usize) -> Envelope {
    let label = Label::broadcast(ContentType::Lmcp, Name::new("afrl.X").unwrap(), source());
    let stamp = Stamp {
        node: source().entity,
        boot: BootId(1),
        sequence,
        source_time: Wall(0),
        lifespan_left_ms: None,
        priority: Priority::Data,
        skipped: 0,
        via: Default::default(),
    };
    Envelope { message: Message::new(Arc::new(label), vec![7; bytes].into()), stamp }
}

/// A recorder, its disk, and the jobs that have not run.
struct Stage {
    recorder: Recorder,
    files: Arc<Mutex<Vec<Vec<u8>>>>,
    fails: Arc<Mutex<bool>>,
    jobs: VecDeque<crate::service::Job>,
    notes: Vec<String>,
}

impl Stage {
    fn new(messages_per_file: u32) -> Self {
        let (files, fails) = (Arc::new(Mutex::new(Vec::<Vec<u8>>::new())), Arc::new(Mutex::new(false)));
        let (on_disk, failing) = (files.clone(), fails.clone());
        let write: Write = Arc::new(move |piece| {
            if *failing.lock().unwrap() {
                return Err("the disk is full".into());
            }
            let mut files = on_disk.lock().unwrap();
            if piece.begins {
                files.push(Vec::new());
            }
            files.last_mut().unwrap().extend_from_slice(&piece.bytes);
            Ok(())
        });
        let fleet = Fleet::new("blue").unwrap();
        let recording = Recording { fleet, addresses: vec![Prefix::all()], messages_per_file, write };
        let recorder = Recorder::new(recording);
        Self { recorder, files, fails, jobs: VecDeque::new(), notes: Vec::new() }
    }

    fn give(&mut self, ms: u64, input: Input<'_>) {
        let mut out = Outbox::new(source());
        self.recorder.handle(now(ms), input, &mut out);
        for action in out.drain() {
            match action {
                Action::Job(_, job) => self.jobs.push_back(job),
                Action::Note(note) => self.notes.push(note.text),
                _ => panic!("neither job nor note"),
            }
        }
    }

    fn messages(&mut self, sequences: std::ops::RangeInclusive<u64>, bytes: usize) {
        for sequence in sequences {
            self.give(0, Input::Message(&envelope(sequence, bytes)));
        }
    }

    /// Lets the disk do all that it was asked to.
    fn write(&mut self, ms: u64) {
        loop {
            while let Some(job) = self.jobs.pop_front() {
                self.give(ms, Input::Job(0, Ok(job())));
            }
            match self.recorder.next_deadline() {
                Some(_) => self.give(ms, Input::Deadline),
                None => return,
            }
        }
    }

    /// The sequences in each file, all of which can be read.
    fn read(&self) -> Vec<Vec<u64>> {
        let files = self.files.lock().unwrap();
        let sequences = |file: &Vec<u8>| {
            let records = Reader::new(file).unwrap().map(|record| record.unwrap().1.stamp.sequence);
            records.collect()
        };
        files.iter().map(sequences).collect()
    }
}

#[test]
fn every_file_holds_so_many_messages_in_their_order() {
    let mut stage = Stage::new(4);
    stage.messages(1..=10, 30);
    stage.write(600);
    assert_eq!(stage.read(), [vec![1, 2, 3, 4], vec![5, 6, 7, 8], vec![9, 10]]);
    stage.messages(11..=13, 30);
    stage.write(1_200);
    assert_eq!(stage.read()[2..], [vec![9, 10, 11, 12], vec![13]]);
    assert_eq!(stage.notes, Vec::<String>::new());
}

#[test]
fn one_piece_is_on_its_way_at_a_time_and_the_end_hands_all_over() {
    let mut stage = Stage::new(2);
    stage.messages(1..=9, 30);
    assert_eq!(stage.jobs.len(), 1);
    stage.give(1, Input::Shutdown);
    assert_eq!(stage.jobs.len(), 5);
    stage.write(2);
    assert_eq!(stage.read().concat(), (1..=9).collect::<Vec<_>>());
}

#[test]
fn what_the_disk_does_not_take_in_time_is_left_out_and_told() {
    let mut stage = Stage::new(1_000);
    stage.messages(1..=40, 1024 * 1024);
    assert!(stage.recorder.waiting_bytes <= WAITING_BYTES_MAX);
    stage.write(600);
    let kept = stage.read().concat();
    assert!(kept.len() < 40 && kept == (1..=kept.len() as u64).collect::<Vec<_>>(), "{kept:?}");
    assert_eq!(stage.notes, [format!("{} messages or pieces are missing in the recording", 40 - kept.len())]);
}

#[test]
fn after_a_failure_a_new_file_begins() {
    let mut stage = Stage::new(100);
    stage.messages(1..=3, 30);
    stage.write(600);
    *stage.fails.lock().unwrap() = true;
    stage.messages(4..=5, 30);
    stage.write(1_200);
    assert_eq!(stage.notes, ["the recording is not written: the disk is full"]);
    *stage.fails.lock().unwrap() = false;
    stage.messages(6..=7, 30);
    stage.write(1_800);
    assert_eq!(stage.read(), [vec![1, 2, 3], vec![6, 7]]);
}
