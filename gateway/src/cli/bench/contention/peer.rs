//! The other processes of `bench contention`: arbiter, provider, consumer, each with a journal.

use super::super::super::exit::Failure;
use super::super::service_node::configuration;
use super::order::{OrderCommand, order};
use super::{ARBITER, CONSUMERS, PROVIDERS, RESOURCE, failed, guid_of, guids, member_of};
use crate::cli::member::Member;
use crate::runtime;
use aldis_envelope::umaa::NoExecutionStatus;
use aldis_envelope::{EntityId, Monotonic, Now, Prefix, ServiceId, Source};
use aldis_services::umaa::allocation::{ControlTold, ControlledConsumer, Guard, GuardSettings, Plan};
use aldis_services::umaa::command::{
    Commanded, ConsumerSettings, Executor, Progress, Provider, ProviderSettings, SessionId, Stop, Stopped,
    Verdict,
};
use aldis_services::{Input, NodeConfig, Outbox, Service, ServiceSpec};
use std::collections::BTreeMap;
use std::io::Read;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// For how long control is asked for: a consumer that is killed loses it soon after.
const SPAN: Duration = Duration::from_secs(2);
/// How long a command is executed at the most, in milliseconds.
const ORDER_MAX: u32 = 20;
/// The longest pause of a consumer, in milliseconds.
const PAUSE_MAX: u64 = 15;

/// What a process does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Part {
    /// Gives control.
    Arbiter,
    /// Executes commands of who controls the resource.
    Provider,
    /// Asks for control, commands, and gives control back.
    Consumer,
}

impl Part {
    /// Its name on the command line.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Arbiter => "arbiter",
            Self::Provider => "provider",
            Self::Consumer => "consumer",
        }
    }
}

/// A process of `bench contention`. It ends in order when its standard input is closed.
#[derive(clap::Args)]
pub(in crate::cli::bench) struct ContentionPeer {
    #[arg(long)]
    connect: String,
    #[arg(long, value_enum)]
    part: Part,
    #[arg(long)]
    entity: u64,
    #[arg(long)]
    journal: PathBuf,
}

impl ContentionPeer {
    pub(in crate::cli::bench) fn run(self) -> Result<(), Failure> {
        let config = configuration(self.entity, &self.tables()?)?;
        let outside = runtime::outside(&config).map_err(failed)?;
        let mut node = runtime::node_config(&config);
        self.add_service(&mut node)?;
        let member = Member::start(node, outside)?;
        // Who started it closes it, or has ended itself.
        let _ = std::io::stdin().read_to_end(&mut Vec::new());
        member.leave()
    }

    fn tables(&self) -> Result<String, Failure> {
        let of = |entities: &[u64]| {
            let ids = entities.iter().map(|&entity| member_of(entity).map(|id| format!("\"{id}\"")));
            Ok::<_, Failure>(ids.collect::<Result<Vec<_>, _>>()?.join(", "))
        };
        let resource = match self.part {
            Part::Arbiter => format!(
                "[[resource]]\nname = \"{RESOURCE}\"\npriorities = [{}]\nrelated = [{}]\n",
                of(&CONSUMERS)?,
                of(&PROVIDERS)?
            ),
            Part::Provider | Part::Consumer => String::new(),
        };
        Ok(format!(
            "mode = \"client\"\nconnect = [{:?}]\n[journal]\npath = {:?}\n\
             [[topic]]\nprefix = \"UMAA::\"\ndurability = \"persistent\"\n{resource}",
            self.connect, self.journal
        ))
    }

    fn add_service(&self, node: &mut NodeConfig) -> Result<(), Failure> {
        let (source, guids) = (member_of(self.entity)?, guids()?);
        let arbiter = EntityId::new(ARBITER).map_err(failed)?;
        let resource = guids.of_resource(arbiter, RESOURCE);
        let factory: Arc<dyn Fn() -> Box<dyn Service> + Send + Sync> = match self.part {
            Part::Arbiter => return Ok(()),
            Part::Provider => Arc::new(move || {
                let guard = Guard::new(source, guids.clone(), GuardSettings::new(resource));
                let settings = ProviderSettings::default();
                let hand = Hand::default();
                Box::new(Provider::<OrderCommand, _, _>::new(source, guids.clone(), settings, hand, guard))
            }),
            Part::Consumer => {
                let providers = PROVIDERS.map(guid_of).into_iter().collect::<Result<Vec<_>, _>>()?;
                let arbiter = guids.of_service(Source::new(arbiter, ServiceId::ALLOCATION));
                let plans: Vec<_> = providers
                    .into_iter()
                    .map(|provider| {
                        let duration = Some(SPAN);
                        Plan { arbiter, resource, duration, provider, command: order(0) }
                    })
                    .collect();
                let seed = self.entity ^ u64::from(std::process::id()) << 32;
                Arc::new(move || {
                    // A provider that was killed is given up soon.
                    let settings = ConsumerSettings {
                        answer_within: Duration::from_secs(3),
                        ..ConsumerSettings::default()
                    };
                    Box::new(Contender {
                        consumer: ControlledConsumer::new(source, guids.clone(), settings),
                        plans: plans.clone(),
                        random: fastrand::Rng::with_seed(seed),
                        next: None,
                    })
                })
            }
        };
        node.services.push(ServiceSpec { source, name: self.part.name().into(), factory });
        Ok(())
    }
}

/// Executes orders: each takes its time.
#[derive(Default)]
struct Hand(BTreeMap<SessionId, Monotonic>);

impl Executor<OrderCommand> for Hand {
    fn validate(&mut self, _: Now, _: Commanded<'_, OrderCommand>, _: &mut Outbox) -> Verdict {
        Verdict::Valid
    }

    fn start(
        &mut self,
        now: Now,
        commanded: Commanded<'_, OrderCommand>,
        _: &mut Outbox,
    ) -> Progress<NoExecutionStatus> {
        let span = Duration::from_millis(commanded.command.milliseconds.into());
        self.0.insert(commanded.id, now.monotonic + span);
        Progress::Running(None)
    }

    fn progress(
        &mut self,
        now: Now,
        commanded: Commanded<'_, OrderCommand>,
        _: &mut Outbox,
    ) -> Progress<NoExecutionStatus> {
        match self.0.get(&commanded.id) {
            Some(&ends) if now.monotonic < ends => Progress::Waiting,
            _ => {
                self.0.remove(&commanded.id);
                Progress::Completed
            }
        }
    }

    fn stop(&mut self, _: Now, commanded: Commanded<'_, OrderCommand>, _: Stop, _: &mut Outbox) -> Stopped {
        self.0.remove(&commanded.id);
        Stopped::Now
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        self.0.values().min().copied()
    }
}

/// Takes control and commands, again and again.
struct Contender {
    consumer: ControlledConsumer<OrderCommand>,
    plans: Vec<Plan<OrderCommand>>,
    random: fastrand::Rng,
    next: Option<Monotonic>,
}

impl Contender {
    fn pause(&mut self, now: Now) {
        self.next = Some(now.monotonic + Duration::from_millis(self.random.u64(0..=PAUSE_MAX)));
    }
}

impl Service for Contender {
    fn subscriptions(&self) -> Vec<Prefix> {
        self.consumer.subscriptions()
    }

    fn follows_bus(&self) -> bool {
        true
    }

    fn goes_by_what_is_kept(&self) -> bool {
        true
    }

    fn handle(&mut self, now: Now, input: Input<'_>, out: &mut Outbox) {
        for told in self.consumer.handle(now, &input, out) {
            if matches!(told, ControlTold::Ended(..)) {
                self.pause(now);
            }
        }
        match input {
            Input::HistoryComplete(_) => self.pause(now),
            Input::Shutdown => self.next = None,
            Input::Deadline if self.next.is_some_and(|at| at <= now.monotonic) => {
                self.next = None;
                let Some(mut plan) = self.random.choice(&self.plans).cloned() else { return };
                plan.command.milliseconds = self.random.u32(1..=ORDER_MAX);
                if self.consumer.start(now, plan, out).is_err() {
                    self.pause(now);
                }
            }
            _ => {}
        }
    }

    fn next_deadline(&self) -> Option<Monotonic> {
        [self.consumer.next_deadline(), self.next].into_iter().flatten().min()
    }
}
