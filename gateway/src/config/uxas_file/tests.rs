//! Configurations of OpenUxAS: the ones that come with it, and wrong ones.

use super::*;
use crate::config::Config;
use std::path::PathBuf;

fn translated(inside: &str) -> (Config, String, Vec<String>) {
    let text =
        format!("<?xml version='1.0'?>\n<UxAS EntityID=\"100\" FormatVersion=\"1.0\">\n{inside}\n</UxAS>\n");
    let imported = translate(&tree::read(text.as_bytes()).unwrap(), Path::new("cfg.xml")).unwrap();
    let config = Config::parse("imported", &imported.toml)
        .unwrap_or_else(|why| panic!("{why}; {}\n{}", why.cure(), imported.toml));
    let remarks = imported.remarks.iter().map(|r| format!("{}: {}", r.line, r.text)).collect();
    (config, imported.toml, remarks)
}

/// All configurations that come with OpenUxAS.
fn scenarios() -> Option<Vec<PathBuf>> {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/uxas/scenarios"));
    if !root.exists() {
        eprintln!("SKIPPED: there is no {}", root.display());
        return None;
    }
    let (mut found, mut left) = (Vec::new(), vec![root.to_owned()]);
    while let Some(directory) = left.pop() {
        for entry in std::fs::read_dir(directory).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                left.push(path);
            } else if path.file_name().is_some_and(|name| name.to_string_lossy().contains("cfg"))
                && path.extension().is_some_and(|extension| extension == "xml")
            {
                found.push(path);
            }
        }
    }
    found.sort();
    Some(found)
}

/// A comment ends at the first `-->`, whatever it holds.
fn without_comments(text: &str) -> String {
    let (mut out, mut rest) = (String::new(), text);
    while let Some((before, comment)) = rest.split_once("<!--") {
        out += before;
        rest = comment.split_once("-->").map_or("", |(_, after)| after);
    }
    out + rest
}

#[test]
fn every_configuration_of_openuxas_becomes_one_that_loads() {
    let Some(files) = scenarios() else { return };
    assert!(files.len() >= 19, "{files:?}");
    for file in files {
        let imported = import(&file).unwrap_or_else(|why| panic!("{}: {why}", file.display()));
        let config = Config::parse("imported", &imported.toml)
            .unwrap_or_else(|why| panic!("{}: {why}; {}\n{}", file.display(), why.cure(), imported.toml));
        let text = std::fs::read_to_string(&file).unwrap();
        let parts = without_comments(&text);
        let count = |tag: &str| parts.matches(tag).count();
        let told = imported
            .remarks
            .iter()
            .filter(|r| r.text.contains(" has no equivalent: "))
            .filter(|r| r.text.starts_with("Bridge ") || r.text.starts_with("Service "));
        // The service manager stands in no file.
        let here = config.bridges.len() + config.services.len() - 1 + told.count();
        assert_eq!(
            here,
            count("<Bridge ") + count("<Service "),
            "{}: nothing is passed over",
            file.display()
        );
        let turn_types = imported
            .remarks
            .iter()
            .filter(|r| r.text.contains("nothing reads the attribute `param.turnType`"));
        assert_eq!(turn_types.count(), count("param.turnType"), "{}", file.display());
    }
}

#[test]
fn bridges_keep_their_addresses_and_filters() {
    let (config, toml, remarks) = translated(
        "<Bridge Type='LmcpObjectNetworkTcpBridge' TcpAddress='tcp://*:9999' Server='TRUE' Sever='x'>
           <SubscribeToMessage MessageType='afrl.cmasi.MissionCommand'/><Other/></Bridge>
         <Bridge Type='LmcpObjectNetworkTcpBridge' TcpAddress='tcp://localhost:5555' Server='FALSE' ConsiderSelfGenerated='FALSE'/>
         <Bridge Type='LmcpObjectNetworkPublishPullBridge' AddressPUB='tcp://*:5560' AddressPULL='tcp://127.0.0.1:5561'/>
         <Bridge Type='LmcpObjectNetworkSubscribePushBridge' AddressSUB='tcp://10.0.0.1:5560' AddressPUSH='tcp://ground:5561'/>
         <Bridge Type='LmcpObjectNetworkZeroMqZyreBridge' NetworkDevice='eth0'/>",
    );
    assert_eq!(config.bridges.len(), 3);
    for part in [
        "kind = \"uxas-tcp\"\nlisten = \"0.0.0.0:9999\"\nname = \"uxas-20\"\nservice = 20\nself_generated = true\n\
         export = [\"afrl.cmasi.MissionCommand\"]",
        "connect = \"127.0.0.1:5555\"\nname = \"uxas-21\"\nservice = 21\nself_generated = false\nexport = []",
        "kind = \"uxas-zmq\"\npublish = \"0.0.0.0:5560\"\npull = \"127.0.0.1:5561\"\nname = \"uxas-22\"",
    ] {
        assert!(toml.contains(part), "{part}\n{toml}");
    }
    for (told, wanted) in remarks.iter().zip([
        "3: nothing reads the attribute `Sever` of Bridge LmcpObjectNetworkTcpBridge",
        "4: `Other` of Bridge LmcpObjectNetworkTcpBridge is not understood",
        "7: Bridge LmcpObjectNetworkSubscribePushBridge has no equivalent: `tcp://ground:5561` is no address",
        "8: Bridge LmcpObjectNetworkZeroMqZyreBridge has no equivalent: nodes of a fleet find",
    ]) {
        assert!(told.starts_with(wanted), "{told}");
    }
    assert_eq!(remarks.len(), 4, "{remarks:?}");
}

#[test]
fn what_has_no_equivalent_is_told_by_name() {
    let (config, toml, remarks) = translated(
        "<Service Type='StatusReportService' VehicleID='400' Odd='1'/>\n<Service Type='New\"Service'/>\n<Thing/>",
    );
    assert_eq!(config.services.len(), 1, "the manager alone");
    assert!(remarks[0].contains("nothing reads the attribute `Odd`"), "{remarks:?}");
    assert!(remarks[1].starts_with("3: Service StatusReportService has no equivalent"), "{remarks:?}");
    assert_eq!(remarks[2], "4: Service New\"Service has no equivalent: no service of this name is known");
    assert_eq!(remarks[3], "5: `Thing` is neither a `Bridge` nor a `Service`");
    assert!(toml.contains("# Line 4: Service New\"Service has no equivalent"), "{toml}");
}

#[test]
fn messages_are_sent_from_beside_the_configuration() {
    let (_, toml, remarks) = translated(
        "<Service Type='SendMessagesService' PathToMessageFiles='../MessagesToSend/'>
           <Message MessageFileName='a.xml' SendTime_ms='200'/>
           <Message MessageFileName='b \"c\".xml' SendPeriod_ms='50.4' NumberTimesToSend='3'/>
           <Message SendTime_ms='1'/></Service>",
    );
    assert_eq!(remarks, ["6: `Message` names no `MessageFileName`"]);
    let beside = std::path::absolute("MessagesToSend").unwrap();
    assert!(toml.contains(&format!("directory = \"{}\"", beside.display())), "{toml}");
    assert!(toml.contains("{ file = \"a.xml\", time_ms = 200 },"), "{toml}");
    assert!(toml.contains("{ file = \"b \\\"c\\\".xml\", period_ms = 50, times = 3 },"), "{toml}");
}

#[test]
fn what_is_no_configuration_is_refused_with_its_line() {
    let refused = |text: &str| match tree::read(text.as_bytes()) {
        Err((line, why)) => format!("{line}: {why}"),
        Ok(root) => {
            let (line, why) = translate(&root, Path::new("x.xml")).unwrap_err();
            format!("{line}: {why}")
        }
    };
    assert_eq!(refused("<a/>"), "1: the root element is `a`, not `UxAS`");
    assert_eq!(refused("\n<UxAS/>"), "2: `UxAS` has no `EntityID`");
    assert_eq!(refused("<UxAS EntityID='0'/>"), "1: `0` is no entity id");
    assert_eq!(refused(""), "1: there is no element");
    assert_eq!(refused("<UxAS>\n<Bridge>\n</Bridge>\n"), "4: the document ends within the element `UxAS`");
    assert_eq!(refused("<UxAS/>\n<UxAS/>"), "2: more than one root element");
    assert!(refused("<UxAS>\n</Bridge>").starts_with("2: "));
    assert!(refused(&"<UxAS>".repeat(20)).contains("nested too deep"));
}

#[test]
fn a_service_is_made_from_the_beginning_of_an_element() {
    let made = |xml: &str| service(xml, 100, 200);
    let open = "<Service Type=\"SendMessagesService\" PathToMessageFiles=\"x\"> <Message MessageFileName=\"a.xml\"/>";
    for xml in [open.to_owned(), format!("{open}</Service>"), quick_xml::escape::escape(open).into_owned()] {
        let Ok(super::super::Service::SendMessages(send)) = made(&xml) else { panic!("{:?}", made(&xml)) };
        assert_eq!((send.messages.len(), send.service.get()), (1, 200));
    }
    assert!(made("<Service Type=\"Nothing\">").unwrap_err().contains("no service of this name"));
    assert!(made("<Bridge Type=\"x\"/>").unwrap_err().contains("`Bridge` is no `Service`"));
    assert!(made("nonsense").is_err());
}
