//! `aldis idl check`: what a folder of IDL declares, and what is wrong in it.

use aldis_tests::{Directory, aldis};
use serde_json::json;

const COMMON: &str = "\
#ifndef COMMON
#define COMMON
module UMAA { module Common { typedef octet NumericGUID[16]; }; };
#endif
";

const REPORT: &str = "\
#include \"Common.idl\"
module UMAA { module T {
  struct IdentifierType { Common::NumericGUID id; Common::NumericGUID parentID; };
  union Pick switch (long) { case 1: double value; default: string<9> text; };
  struct XReportType { @optional Pick pick; @key IdentifierType source; @key long number; };
  const string XReportTypeTopic = \"UMAA::T::XReport\";
}; };
";

#[test]
fn a_folder_is_listed_with_topics_types_and_keys() {
    let folder = Directory::new();
    folder.write("Common.idl", COMMON);
    folder.write("XReport.IDL", REPORT);
    let path = folder.path().display().to_string();
    let done = aldis(["idl", "check", &path, "--json"]);
    assert_eq!(done.code, Some(0), "{done:?}");
    let guid = "UMAA::Common::NumericGUID";
    let keys = json!([
        { "path": "source.id", "type": guid }, { "path": "source.parentID", "type": guid },
        { "path": "number", "type": "long" },
    ]);
    assert_eq!(
        done.json(),
        [
            json!({
                "topic": "UMAA::T::XReport", "type": "UMAA::T::XReportType", "extensibility": "appendable",
                "keys": keys, "key_fits_hash": false,
            }),
            json!({ "ok": true, "files": 2, "topics": 1, "types": 4 }),
        ]
    );
    let text = aldis(["idl", "check", &path, "--default", "final"]).stdout;
    assert!(
        text.contains("UMAA::T::XReportType, final\n  key UMAA::Common::NumericGUID source.id"),
        "{text}"
    );
}

#[test]
fn a_mistake_is_told_with_file_and_line() {
    let folder = Directory::new();
    folder.write("XReport.idl", REPORT);
    let path = folder.path().display().to_string();
    let done = aldis(["idl", "check", &path, "--json"]);
    assert_eq!(done.code, Some(1), "{done:?}");
    let told = done.json();
    assert_eq!((&told[0]["file"], &told[0]["line"]), (&json!("XReport.idl"), &json!(1)));
    assert_eq!(told[0]["message"], "no file `Common.idl` is there: add it to the folder");
    let nothing = aldis(["idl", "check", &folder.path().join("gone").display().to_string()]);
    assert_eq!(nothing.code, Some(2), "{nothing:?}");
    assert!(nothing.stderr.contains("cannot read"), "{}", nothing.stderr);
}
