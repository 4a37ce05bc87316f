//! `aldis bench join`: a late joiner of many retained instances, while their writer keeps writing.

use super::super::exit::Failure;
use super::super::print_line;
use super::child::{Process, free_port};
use super::service_node::{label, member, source};
use aldis_envelope::{Instance, KeyHash, Label, Message, Monotonic, Now, Prefix};
use aldis_services::{Input, Outbox, Service};
use bytes::Bytes;
use serde_json::json;
use std::collections::BTreeSet;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

const TOPIC: &str = "UMAA::SO::Bench::BenchReport";
const RESULT: &str = "bench.join.Result";
/// How long the joiner watches what is written after it has caught up.
const WATCH: Duration = Duration::from_secs(2);
/// How long all of it may take.
const PATIENCE: Duration = Duration::from_secs(60);
/// How often the writer writes.
const TICK: Duration = Duration::from_millis(1);

/// How a new process gets all retained instances while their writer writes on: complete, once each, in order.
#[derive(clap::Args)]
pub(super) struct JoinBench {
    /// Retained instances.
    #[arg(long, default_value_t = 10_000)]
    instances: u64,
    /// Samples written a second meanwhile, at most 100 000.
    #[arg(long, default_value_t = 1_000, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    rate: u64,
    /// Bytes of each sample.
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u64).range(8..=60_000))]
    size: u64,
    /// One JSON object.
    #[arg(long)]
    json: bool,
}

/// The late joiner of `bench join`.
#[derive(clap::Args)]
pub(super) struct Joiner {
    #[arg(long)]
    connect: String,
}

/// Writes every instance once, then goes on round about.
struct Writing {
    label: Arc<Label>,
    instances: u64,
    rate: u64,
    size: usize,
    written: u64,
    next: Option<Monotonic>,
    start: Option<Monotonic>,
    tell: mpsc::Sender<Vec<u64>>,
}

impl Writing {
    fn write(&mut self, out: &mut Outbox) {
        let mut content = vec![0; self.size];
        content[..8].copy_from_slice(&self.written.to_le_bytes());
        let instance = Instance::of_number((self.written % self.instances) as i64);
        out.send(Message::new(self.label.clone(), content.into()).of_instance(instance));
        self.written += 1;
    }
}

impl Service for Writing {
    fn subscriptions(&self) -> Vec<Prefix> {
        Prefix::new(RESULT).into_iter().collect()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Started => {
                (0..self.instances).for_each(|_| self.write(out));
                self.start = Some(now.monotonic);
                self.next = Some(now.monotonic + TICK);
            }
            Input::Deadline => {
                let elapsed = self.start.map(|start| now.monotonic - start).unwrap_or_default();
                let due = self.instances + (elapsed.as_secs_f64() * self.rate as f64) as u64;
                (self.written..due).for_each(|_| self.write(out));
                self.next = Some(now.monotonic + TICK);
            }
            Input::Message(envelope) => {
                let figures = envelope.message.content.chunks_exact(8);
                let figures = figures.map(|figure| u64::from_le_bytes(figure.try_into().unwrap_or_default()));
                let _ = self.tell.send(figures.collect());
            }
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}

/// Counts what it gets.
struct Joining {
    label: Arc<Label>,
    started: Monotonic,
    instances: BTreeSet<KeyHash>,
    last: Option<u64>,
    samples: u64,
    disordered: u64,
    missing: u64,
    complete_after: Option<(Duration, u64, u64)>,
    next: Option<Monotonic>,
}

impl Service for Joining {
    fn subscriptions(&self) -> Vec<Prefix> {
        Prefix::new("UMAA::SO::Bench").into_iter().collect()
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        match input {
            Input::Started => self.started = now.monotonic,
            Input::Message(envelope) => {
                let message = &envelope.message;
                let Some(Ok(number)) =
                    message.content.get(..8).map(|head| head.try_into().map(u64::from_le_bytes))
                else {
                    return;
                };
                self.samples += 1;
                self.instances.extend(message.instance.as_ref().map(|instance| instance.hash));
                match self.last {
                    Some(last) if number <= last => self.disordered += 1,
                    Some(last) if self.complete_after.is_some() => self.missing += number - last - 1,
                    _ => {}
                }
                self.last = Some(number);
            }
            Input::HistoryComplete(complete) => {
                let (seen, after) = (self.instances.len() as u64, now.monotonic - self.started);
                self.complete_after = Some((after, seen, u64::from(complete)));
                self.next = Some(now.monotonic + WATCH);
            }
            Input::Deadline => {
                self.next = None;
                let (after, seen, complete) = self.complete_after.unwrap_or_default();
                let after = after.as_micros() as u64;
                let figures = [complete, after, seen, self.samples, self.disordered, self.missing];
                let content: Vec<u8> = figures.iter().flat_map(|figure| figure.to_le_bytes()).collect();
                out.send(Message::new(self.label.clone(), Bytes::from(content)));
            }
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.next
    }
}

impl JoinBench {
    pub(super) fn run(self) -> Result<(), Failure> {
        let locator = format!("tcp/127.0.0.1:{}", free_port()?);
        let (tell, told) = mpsc::channel();
        let (label, size) = (label(TOPIC, source(1)?)?, self.size as usize);
        let (instances, rate) = (self.instances.max(1), self.rate);
        let make = move || -> Box<dyn Service> {
            let (label, tell) = (label.clone(), tell.clone());
            Box::new(Writing { label, instances, rate, size, written: 0, next: None, start: None, tell })
        };
        let writer = member(1, &format!("listen = [\"{locator}\"]"), make)?;
        let begun = Instant::now();
        let _joiner = Process::start(&["bench", "joiner", "--connect", &locator])?;
        let figures = told
            .recv_timeout(PATIENCE)
            .map_err(|_| Failure::Failed(format!("the late joiner does not answer within {PATIENCE:?}")))?;
        let process_ms = (begun.elapsed() - WATCH).as_millis() as u64;
        writer.leave()?;
        let &[complete, after, seen, samples, disordered, missing] = &figures[..] else {
            return Err(Failure::Failed("the late joiner's answer cannot be read".into()));
        };
        let result = json!({
            "instances": instances, "rate_per_s": rate, "bytes": self.size,
            "complete": complete == 1 && seen == instances,
            "instances_seen": seen,
            "complete_after_ms": after / 1_000,
            "with_start_of_process_ms": process_ms,
            "samples": samples, "twice_or_out_of_order": disordered, "lost_afterwards": missing,
        });
        print_line(if self.json { result.to_string() } else { format!("{result:#}") });
        if complete == 1 && seen == instances && disordered == 0 && missing == 0 {
            return Ok(());
        }
        Err(Failure::Failed("the late joiner did not get every instance once and in order".into()))
    }
}

impl Joiner {
    pub(super) fn run(self) -> Result<(), Failure> {
        let label = label(RESULT, source(2)?)?;
        let make = move || -> Box<dyn Service> {
            Box::new(Joining {
                label: label.clone(),
                started: Monotonic::START,
                instances: BTreeSet::new(),
                last: None,
                samples: 0,
                disordered: 0,
                missing: 0,
                complete_after: None,
                next: None,
            })
        };
        let _member = member(2, &format!("connect = [\"{}\"]", self.connect), make)?;
        super::serve_until_killed()
    }
}
