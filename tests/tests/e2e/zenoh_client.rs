//! A plain Zenoh client: what any other program on the bus may do.

use aldis_envelope::codec::native::encode;
use aldis_envelope::{
    BootId, ContentType, EntityId, Envelope, Fleet, Keys, Label, Message, Name, Priority, ServiceId, Source,
    Space, Stamp, Wall,
};
use std::sync::{Arc, mpsc};
use std::time::Duration;
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

/// Opens a session as a client of a router on this machine, as a user where one is given. None where it is refused.
pub(crate) fn open(port: u16, user: Option<(&str, &str)>) -> Option<Session> {
    let mut config = zenoh::Config::default();
    let mut set = |key: &str, value: &str| config.insert_json5(key, value).unwrap();
    set("mode", "\"client\"");
    set("connect/endpoints", &format!("[\"tcp/127.0.0.1:{port}\"]"));
    set("connect/timeout_ms", "0");
    set("scouting/multicast/enabled", "false");
    if let Some((user, password)) = user {
        set("transport/auth/usrpwd", &format!("{{ user: \"{user}\", password: \"{password}\" }}"));
    }
    zenoh::open(config).wait().ok()
}

/// An envelope of a source, as it goes on the bus: key, header, content.
pub(crate) fn envelope(
    entity: u64,
    address: &str,
    sequence: u64,
    content: &str,
) -> (String, Vec<u8>, String) {
    let node = EntityId::new(entity).unwrap();
    let source = Source::new(node, ServiceId::new(61).unwrap());
    let label = Arc::new(Label::broadcast(ContentType::Lmcp, Name::new(address).unwrap(), source));
    let stamp = Stamp {
        node,
        boot: BootId(1),
        sequence,
        source_time: Wall(0),
        lifespan_left_ms: None,
        priority: Priority::Data,
        skipped: 0,
        via: Default::default(),
    };
    let key = Keys::new(&Fleet::new("fleet").unwrap()).envelope(Space::Data, &label, None);
    let mut header = Vec::new();
    encode(
        &Envelope { message: Message::new(label, content.as_bytes().to_vec().into()), stamp },
        &mut header,
    );
    (key, header, content.to_owned())
}

/// What a session hears on a key expression, as `Put key` and `Delete key`.
pub(crate) struct Ear(mpsc::Receiver<String>);

impl Ear {
    /// Listens to samples.
    pub(crate) fn on_samples(session: &Session, expression: &str) -> Self {
        let (tell, told) = mpsc::channel();
        let hear = move |sample: Sample| drop(tell.send(said(&sample)));
        session.declare_subscriber(expression.to_owned()).callback(hear).background().wait().unwrap();
        Self(told)
    }

    /// Listens to liveliness tokens.
    pub(crate) fn on_tokens(session: &Session, expression: &str) -> Self {
        let (tell, told) = mpsc::channel();
        let hear = move |sample: Sample| drop(tell.send(said(&sample)));
        let liveliness = session.liveliness();
        liveliness
            .declare_subscriber(expression.to_owned())
            .history(true)
            .callback(hear)
            .background()
            .wait()
            .unwrap();
        Self(told)
    }

    /// The next that is heard.
    pub(crate) fn next(&self) -> String {
        self.0.recv_timeout(aldis_tests::PATIENCE).expect("something is heard")
    }

    /// Whether anything is heard for a moment.
    pub(crate) fn hears_something(&self) -> bool {
        self.0.recv_timeout(Duration::from_millis(20)).is_ok()
    }

    /// All that is heard up to and with this.
    pub(crate) fn upto(&self, last: &str) -> Vec<String> {
        let mut heard = vec![self.next()];
        while heard.last().is_some_and(|said| said != last) {
            heard.push(self.next());
        }
        heard
    }
}

fn said(sample: &Sample) -> String {
    format!("{} {}", sample.kind(), sample.key_expr())
}
