//! Two Zenoh sessions in one process, joined by TCP and by nothing else.

use aldis_tests::{PATIENCE, free_port};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::time::Instant;
use zenoh::qos::CongestionControl;
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

/// Where the two sessions agree that all is declared, and that all has come: no chunk of a fleet's key begins so.
const FENCE: &str = "fence";

pub(crate) struct Network {
    hearer: Session,
    sayer: Session,
}

fn open(settings: &[(&str, String)]) -> Session {
    let mut config = zenoh::Config::default();
    let alone =
        [("mode", "peer"), ("scouting/multicast/enabled", "false"), ("scouting/gossip/enabled", "false")];
    let alone = alone.map(|(key, value)| match value {
        "peer" => (key, "\"peer\"".to_owned()),
        flag => (key, flag.to_owned()),
    });
    for (key, value) in alone.iter().chain(settings) {
        config.insert_json5(key, value).expect("a setting");
    }
    zenoh::open(config).wait().expect("a session")
}

impl Network {
    pub(crate) fn open() -> Self {
        let locator = format!("[\"tcp/127.0.0.1:{}\"]", free_port());
        let nowhere = "[]".to_owned();
        let hearer = open(&[("listen/endpoints", locator.clone())]);
        let sayer = open(&[("listen/endpoints", nowhere), ("connect/endpoints", locator)]);
        Self { hearer, sayer }
    }

    /// Puts on each of these keys, and says which of the puts (by their places) came to each of these expressions.
    pub(crate) fn arrivals(
        &self,
        expressions: &BTreeSet<String>,
        keys: &[String],
    ) -> BTreeMap<String, BTreeSet<usize>> {
        let subscriptions: Vec<_> = expressions
            .iter()
            .map(|expression| {
                let arrived = Arc::new(Mutex::new(Vec::new()));
                let heard = arrived.clone();
                let take = move |sample: Sample| {
                    heard.lock().unwrap_or_else(PoisonError::into_inner).push(text(&sample));
                };
                let subscriber = self.hearer.declare_subscriber(expression).callback(take).wait();
                (expression, arrived, subscriber.expect("a subscriber"))
            })
            .collect();
        self.pass_the_fence("declared");
        for (place, key) in keys.iter().enumerate() {
            let put = self.sayer.put(key, place.to_string()).congestion_control(CongestionControl::Block);
            put.wait().expect("a put");
        }
        self.pass_the_fence("put");
        let all = subscriptions.iter().map(|(expression, heard, _)| {
            let heard = heard.lock().unwrap_or_else(PoisonError::into_inner);
            let places: BTreeSet<usize> = heard.iter().map(|place| place.parse().expect("a place")).collect();
            assert_eq!(places.len(), heard.len(), "no put comes twice to {expression}");
            ((*expression).clone(), places)
        });
        all.collect()
    }

    /// Waits until a word passes from one session to the other. Declarations and puts stay in their order: what was
    /// declared before is known by then, and what was put before has come.
    fn pass_the_fence(&self, word: &str) {
        let fence = format!("{FENCE}/{word}");
        let (tell, told) = mpsc::channel();
        let take = move |sample: Sample| {
            // Nobody waits any more for a word said again.
            let _ = tell.send(text(&sample));
        };
        let _subscriber = self.hearer.declare_subscriber(&fence).callback(take).wait().expect("a subscriber");
        let publisher = self.sayer.declare_publisher(&fence).congestion_control(CongestionControl::Block);
        let publisher = publisher.wait().expect("a publisher");
        let listener = publisher.matching_listener().wait().expect("a listener");
        let begin = Instant::now();
        while !publisher.matching_status().wait().expect("a status").matching() {
            let left = PATIENCE.saturating_sub(begin.elapsed());
            let changed = listener.recv_timeout(left).expect("a listener");
            assert!(changed.is_some(), "the sessions are not joined within {PATIENCE:?}");
        }
        publisher.put(word).wait().expect("a put");
        assert_eq!(told.recv_timeout(PATIENCE).expect("the word comes"), word);
    }
}

fn text(sample: &Sample) -> String {
    sample.payload().try_to_string().expect("UTF-8").into_owned()
}
