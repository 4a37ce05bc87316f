use super::*;
use crate::description::{Definition, Type};
use proptest::collection::vec;
use proptest::prelude::*;

fn read(files: &[(&str, &str)]) -> Result<Idl, Vec<String>> {
    let files = files.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned())).collect();
    parse(&files, Extensibility::Appendable)
        .map_err(|errors| errors.iter().map(IdlError::to_string).collect())
}

fn error(text: &str) -> String {
    read(&[("a.idl", text)]).unwrap_err().join("\n")
}

const COMMON: &str = r#"
#ifndef COMMON_IDL
#define COMMON_IDL
/* what all
   share */
module UMAA { module Common {
  typedef octet NumericGUID[16]; // RFC 4122
  const long TEXT = (1 << 12) - 1;
  typedef string<TEXT> StringLongDescription;
  @unit(value = "s") @range(min = 0.0, max = 37817280) typedef double DurationSeconds;
  struct DateTime { long long seconds; @range(min=0,max=999999999) long nanoseconds; };
}; };
#endif
"#;

const REPORT: &str = r#"
#include "UMAA/Common.idl"
#include <Kind.idl>
module UMAA { module SO { module Test {
  @final struct Base { @key UMAA::Common::NumericGUID source; };
  struct Node;
  struct Node { sequence<Node, 4> children; @optional Common::DurationSeconds wait, longer; };
  union Pick switch (Kind) {
    case LOW: case KindModule::MIDDLE: unsigned short low;
    default: @hashid("color") Common::StringLongDescription high;
  };
  const string TestReportTypeTopic = "UMAA::SO::Test::" "TestReport";
  @extensibility(FINAL)
  struct TestReportType : Base {
    @id(7) Pick pick;
    double grid[2][3];
    @must_understand(FALSE) sequence<sequence<boolean>> nested;
    @key @id(0x10) Common::DateTime stamp;
  };
  @topic struct Other { @key long id; };
}; }; };
"#;

const KIND: &str = r#"
module KindModule { @bit_bound(8) enum Kind { LOW, MIDDLE = 4, @default_literal HIGH }; };
typedef KindModule::Kind Kind;
@bit_bound(16) bitmask Flags { ONE, @position(9) TEN, ELEVEN };
"#;

#[test]
fn a_folder_becomes_a_library_with_its_topics() {
    let files = [("UMAA/Common.idl", COMMON), ("A/Report.idl", REPORT), ("Kind.idl", KIND)];
    let Idl { library, topics } = read(&files).unwrap();
    let named: Vec<_> = topics.iter().map(|topic| (topic.name.as_str(), topic.type_name.as_str())).collect();
    assert_eq!(
        named,
        [
            ("UMAA::SO::Test::Other", "UMAA::SO::Test::Other"),
            ("UMAA::SO::Test::TestReport", "UMAA::SO::Test::TestReportType"),
        ]
    );
    let report = library.structure("UMAA::SO::Test::TestReportType").unwrap();
    assert_eq!(report.extensibility, Extensibility::Final);
    let members = library.members(report).into_iter();
    let members: Vec<_> = members.map(|member| (member.name.as_str(), member.id, member.key)).collect();
    assert_eq!(
        members,
        [
            ("source", 0, true),
            ("pick", 7, false),
            ("grid", 8, false),
            ("nested", 9, false),
            ("stamp", 16, true)
        ]
    );
    let paths: Vec<_> =
        library.key_members("UMAA::SO::Test::TestReportType").into_iter().map(|key| key.path).collect();
    assert_eq!(paths, ["source", "stamp.seconds", "stamp.nanoseconds"]);
    let grid = Type::Array { element: Box::new(Type::Float64), dimensions: vec![2, 3] };
    assert_eq!(report.members[1].r#type, grid);
    let node = library.structure("UMAA::SO::Test::Node").unwrap();
    assert_eq!(node.extensibility, Extensibility::Appendable);
    assert_eq!(node.members[0].r#type, Type::sequence(Type::named("UMAA::SO::Test::Node"), Some(4)));
    assert!(node.members[1].optional && node.members[2].optional && node.members[2].name == "longer");
    let pick = library.union("UMAA::SO::Test::Pick").unwrap();
    let cases: Vec<_> = pick.cases.iter().map(|case| (case.labels.clone(), case.default)).collect();
    assert_eq!(cases, [(vec![0, 4], false), (vec![], true)]);
    // The standard's own example of a hashed id (DDS-XTypes 1.3, 7.3.1.2.1.1): "color" is 0x0fa5dd70.
    assert_eq!(pick.cases[1].member.id, 0x0fa5_dd70);
    let kind = library.enumeration("Kind").unwrap();
    assert_eq!((kind.bit_bound, kind.default, kind.name_of(5)), (8, Some(5), Some("HIGH")));
    let text = library.get("UMAA::Common::StringLongDescription");
    assert_eq!(text, Some(&Definition::Alias(Type::String { bound: Some(4095) })));
    let Some(Definition::Bitmask(flags)) = library.get("Flags") else { panic!() };
    let places: Vec<_> = flags.flags.iter().map(|(_, place)| *place).collect();
    assert_eq!((flags.bit_bound, places), (16, vec![0, 9, 10]));
}

#[test]
fn what_is_wrong_is_told_with_file_line_and_cure() {
    assert_eq!(
        error("struct A {\n  Missing m;\n};"),
        "a.idl:2: no type `Missing` is known: define it before, or include the file that does"
    );
    assert_eq!(error("#include \"b.idl\"\n"), "a.idl:1: no file `b.idl` is there: add it to the folder");
    assert_eq!(error("/* a\n\n"), "a.idl:1: a comment that is not ended: put `*/` at its end");
    assert_eq!(error("#ifdef A\n"), "a.idl:1: a condition that is not ended: put `#endif` at its end");
    assert_eq!(error("struct A { long a }"), "a.idl:1: `;` is due, `}` stands here");
    assert_eq!(error("struct A { long a;"), "a.idl:1: a name is due, the end of the file stands here");
    assert_eq!(error("const string s = \"a"), "a.idl:1: a text that is not ended: put `\"` at its end");
    assert!(error("interface A {};").starts_with("a.idl:1: `interface` is not read: module, const"));
    assert_eq!(error("const long A = 1 / 0;"), "a.idl:1: `/` has no result here: use numbers that it fits");
    assert!(error("struct A { string<0> a; };").contains("a bound or dimension of 0: 1 to 4294967295"));
    assert!(error("\nstruct A { A a; };").starts_with("a.idl:2: `A`: it holds itself"));
    assert!(error("struct A { long a; };\nstruct A { short a; };").contains("(before in a.idl:1)"));
    assert!(error("const string XTopic = \"X\";").starts_with("a.idl:1: the topic `X` has no type"));
    assert!(error("struct A { map<long, long> a; };").contains("`map` is not read"));
    assert!(error("enum E { A }; union U switch (E) { case B: long b; };").contains("`B` is no value"));
    assert!(error("#define MAX 5\n").contains("the macro `MAX` has a value"));
    assert!(error("struct A { long é; };").contains("is no part of IDL"));
    assert!(
        error("@extensibility(OPEN) struct A { long a; };").contains("wants FINAL, APPENDABLE or MUTABLE")
    );
    // Of several files each tells its first mistake.
    let both = read(&[("a.idl", "struct A { B b; };"), ("b.idl", "#if X > 2\n#endif")]).unwrap_err();
    assert_eq!(both.len(), 2, "{both:?}");
}

#[test]
fn files_that_include_each_other_are_read_once() {
    let a = "#include \"b.idl\"\nstruct A { long a; };";
    let b = "#include \"a.idl\"\nstruct B { long b; };";
    let idl = read(&[("x/a.idl", a), ("x/b.idl", b)]).unwrap();
    assert_eq!(idl.library.definitions().count(), 2);
    assert_eq!(read(&[]).unwrap().topics, []);
}

#[test]
fn nothing_is_nested_too_deep_to_be_told_so() {
    let deep = |before: &str, middle: &str, after: &str| {
        error(&format!("{}{middle}{}", before.repeat(5_000), after.repeat(5_000)))
    };
    assert!(deep("module m { ", "", "};").contains("nested too deep"));
    let of = |middle: String| error(&format!("typedef {middle} a;"));
    assert!(
        of(format!("{}long{}", "sequence<".repeat(5_000), ">".repeat(5_000))).contains("nested too deep")
    );
    let expression = |text: String| error(&format!("const long A = {text};"));
    assert!(expression(format!("{}1{}", "(".repeat(5_000), ")".repeat(5_000))).contains("nested too deep"));
    assert!(expression(format!("{}1", "-".repeat(5_000))).contains("nested too deep"));
    assert!(error(&format!("typedef long a{};", "[1]".repeat(5_000))).contains("dimensions"));
}

proptest! {
    #[test]
    fn no_text_does_harm(
        pieces in vec(prop_oneof![
            Just("struct A { long a; };"), Just("module m {"), Just("};"), Just("@key"), Just("@id("), Just("sequence<"),
            Just(">"), Just("union U switch (long) { case 1: long a; };"), Just("#if 1\n"), Just("#endif\n"), Just("\""),
            Just("/*"), Just("*/"), Just("const long A = "), Just("1 <<"), Just(";"), Just("::"), Just("[3]"), Just("é"),
            Just("enum E { A, B };"), Just("L'a'"), Just("0x"), Just("1e"), Just("1.5"), Just("\\"), Just("#include \"a.idl\"\n"),
            Just("'"), Just("typedef string<3> T;"), Just("bitmask F { A };"), Just("default:"), Just("-"), Just("= T"),
        ], 0..24),
        random in ".{0,60}",
    ) {
        let _ = read(&[("a.idl", &pieces.join(" ")), ("b.idl", &random)]);
        let _ = read(&[("a.idl", &(REPORT.to_owned() + &pieces.join("\n"))), ("UMAA/Common.idl", COMMON), ("Kind.idl", KIND)]);
    }
}
