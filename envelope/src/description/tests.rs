use super::*;
use crate::KeyWidth;

fn structure(members: Vec<Member>) -> Definition {
    Definition::Structure(Structure { members, ..Structure::default() })
}

fn finish<const N: usize>(definitions: [(&str, Definition); N]) -> Result<Library, Vec<DescriptionError>> {
    let mut draft = Draft::default();
    definitions.into_iter().for_each(|(name, definition)| draft.add(name, definition).unwrap());
    draft.finish()
}

fn fault<const N: usize>(definitions: [(&str, Definition); N]) -> Fault {
    let mut errors = finish(definitions).unwrap_err();
    errors.remove(0).fault
}

fn guid() -> Definition {
    Definition::Alias(Type::array(Type::Octet, 16))
}

#[test]
fn keys_are_found_through_nested_structures() {
    let id = structure(vec![
        Member::new(0, "id", Type::named("Guid")),
        Member::new(1, "parentID", Type::named("Guid")),
        Member::new(2, "note", Type::String { bound: Some(9) }).optional(),
    ]);
    let named = structure(vec![
        Member::new(0, "note", Type::Int32),
        Member::new(1, "name", Type::String { bound: Some(8) }).key(),
    ]);
    let base = structure(vec![Member::new(0, "source", Type::named("a::Id")).key()]);
    let top = Structure {
        base: Some("Base".to_owned()),
        members: vec![Member::new(1, "x", Type::Int64), Member::new(2, "named", Type::named("Named")).key()],
        ..Structure::default()
    };
    let definitions = [
        ("Guid", guid()),
        ("a::Id", id),
        ("Named", named),
        ("Base", base),
        ("Top", Definition::Structure(top)),
        ("Other", Definition::Alias(Type::named("Top"))),
    ];
    let library = finish(definitions).unwrap();
    let paths = |name: &str| library.key_members(name).into_iter().map(|key| key.path).collect::<Vec<_>>();
    assert_eq!(paths("Other"), ["source.id", "source.parentID", "named.name"]);
    assert_eq!(paths("Named"), ["name"]);
    assert_eq!((library.key_width("Top"), library.key_width("Named")), (KeyWidth::Wider, KeyWidth::Fits16));
    assert_eq!(library.needed_by("Other"), ["Guid", "a::Id", "Base", "Named", "Top", "Other"]);
}

#[test]
fn a_key_fits_where_its_longest_value_does() {
    let width = |members: Vec<Type>| {
        let members = (0..).zip(members).map(|(id, held)| Member::new(id, format!("m{id}"), held).key());
        finish([("T", structure(members.collect())), ("Guid", guid())]).unwrap().key_width("T")
    };
    assert_eq!(width(vec![Type::named("Guid")]), KeyWidth::Fits16);
    assert_eq!(width(vec![Type::named("Guid"), Type::Octet]), KeyWidth::Wider);
    // In XCDR2 eight bytes stand on any place that four do.
    assert_eq!(width(vec![Type::Octet, Type::Int64, Type::Int32]), KeyWidth::Fits16);
    assert_eq!(width(vec![Type::Octet, Type::Int64, Type::Int32, Type::Octet]), KeyWidth::Wider);
    assert_eq!(width(vec![Type::String { bound: Some(11) }]), KeyWidth::Fits16);
    assert_eq!(width(vec![Type::String { bound: Some(12) }]), KeyWidth::Wider);
    assert_eq!(width(vec![Type::String { bound: None }]), KeyWidth::Wider);
    assert_eq!(width(Vec::new()), KeyWidth::Fits16);
}

#[test]
fn what_holds_itself_is_refused_unless_something_may_be_absent() {
    let holds = |held: Type| structure(vec![Member::new(0, "m", held)]);
    assert_eq!(fault([("A", holds(Type::named("A")))]), Fault::HoldsItself);
    assert_eq!(
        fault([("A", holds(Type::array(Type::named("B"), 2))), ("B", holds(Type::named("A")))]),
        Fault::HoldsItself
    );
    assert_eq!(fault([("A", Definition::Alias(Type::named("A")))]), Fault::HoldsItself);
    assert_eq!(fault([("A", Definition::Alias(Type::sequence(Type::named("A"), None)))]), Fault::HoldsItself);
    let through_base = Structure { base: Some("A".to_owned()), ..Structure::default() };
    assert_eq!(fault([("A", Definition::Structure(through_base))]), Fault::HoldsItself);
    assert!(finish([("A", holds(Type::sequence(Type::named("A"), None)))]).is_ok());
    let optional = structure(vec![Member::new(0, "m", Type::named("A")).optional()]);
    assert_eq!(finish([("A", optional)]).unwrap().needed_by("A"), ["A"]);
}

#[test]
fn nothing_is_too_large_or_too_deep_to_be_told_so() {
    let mut draft = Draft::default();
    for depth in 0..200 {
        let next = Type::named(format!("T{}", depth + 1));
        let twice = vec![Member::new(0, "a", next.clone()), Member::new(1, "b", next)];
        draft.add(format!("T{depth}"), structure(twice)).unwrap();
    }
    draft.add("T200", guid()).unwrap();
    let errors = draft.finish().unwrap_err();
    let of = |name: &str| errors.iter().find(|error| error.type_name == name).map(|error| &error.fault);
    assert_eq!(
        (of("T0"), of("T180"), of("T190")),
        (Some(&Fault::TooDeep), Some(&Fault::TooManyMembers), None)
    );
    let array = Type::Array { element: Box::new(Type::Octet), dimensions: vec![u32::MAX; 3] };
    assert_eq!(fault([("A", Definition::Alias(array))]), Fault::ArrayTooLarge);
    let nested = (0..200).fold(Type::Octet, |inner, _| Type::sequence(inner, None));
    assert_eq!(fault([("A", Definition::Alias(nested))]), Fault::TooDeep);
    // A chain of sequences is walked without a stack.
    let mut draft = Draft::default();
    for depth in 0..20_000 {
        let next = Type::sequence(Type::named(format!("T{}", depth + 1)), None);
        draft.add(format!("T{depth}"), structure(vec![Member::new(0, "a", next)])).unwrap();
    }
    draft.add("T20000", guid()).unwrap();
    assert_eq!(draft.finish().unwrap().needed_by("T0").len(), 20_001);
}

#[test]
fn each_fault_is_told_with_its_place() {
    let member = |name: &str| Member::new(0, name, Type::Octet);
    let why = finish([("a::T", structure(vec![member("m"), Member::new(1, "n", Type::named("Gone"))]))]);
    assert_eq!(
        why.unwrap_err()[0].to_string(),
        "`a::T`: no type `Gone` is known: define it, or include the file that does"
    );
    let why = finish([("T", structure(vec![member("m").key().optional()]))]).unwrap_err();
    assert_eq!(why[0].to_string(), "`T`, member `m`: a key cannot be optional");
    assert_eq!(fault([("T", structure(vec![member("m"), member("n")]))]), Fault::DuplicateNumber(0));
    assert_eq!(
        fault([("T", structure(vec![member("m"), Member::new(1, "m", Type::Octet)]))]),
        Fault::DuplicateName("m".to_owned())
    );
    assert_eq!(
        fault([("T", structure(vec![Member { id: u32::MAX, ..member("m") }]))]),
        Fault::IdTooHigh(u32::MAX)
    );
    assert_eq!(
        fault([("T", structure(vec![Member::new(0, "m", Type::String { bound: Some(0) })]))]),
        Fault::ZeroBound
    );
    let base =
        |base: &str| Definition::Structure(Structure { base: Some(base.to_owned()), ..Structure::default() });
    assert_eq!(fault([("T", base("U")), ("U", guid())]), Fault::BaseIsNoStructure("U".to_owned()));
    let closed = Structure { extensibility: Extensibility::Final, ..Structure::default() };
    let other = Fault::BaseGrowsOtherwise("U".to_owned());
    assert_eq!(fault([("T", base("U")), ("U", Definition::Structure(closed))]), other);
    let numbers = Enumeration { bit_bound: 3, ..Enumeration::counted(["a", "b"]) };
    let bad = |enumeration| fault([("E", Definition::Enumeration(enumeration))]);
    assert_eq!(bad(Enumeration { default: Some(2), ..numbers.clone() }), Fault::UnknownDefault(2));
    let high = Enumeration { literals: vec![("a".to_owned(), 8)], ..numbers.clone() };
    assert_eq!(bad(high), Fault::DoesNotFit { value: 8, bits: 3 });
    assert_eq!(
        bad(Enumeration { bit_bound: 33, ..numbers.clone() }),
        Fault::BadBitBound { found: 33, max: 32 }
    );
    assert_eq!(bad(Enumeration::counted([])), Fault::Empty);
    let bits =
        Bitmask { bit_bound: 8, extensibility: Extensibility::Final, flags: vec![("f".to_owned(), 8)] };
    assert_eq!(fault([("B", Definition::Bitmask(bits))]), Fault::DoesNotFit { value: 8, bits: 8 });
}

#[test]
fn a_union_is_chosen_by_what_can_choose() {
    let case = |id: u32, labels: &[i64], default| {
        let member = Member::new(id, format!("m{id}"), Type::Octet);
        Case { labels: labels.to_vec(), default, member }
    };
    let union = |discriminator: Type, cases: Vec<Case>| {
        Definition::Union(Union { extensibility: Extensibility::Final, discriminator, key: false, cases })
    };
    let refused = |discriminator, cases| fault([("U", union(discriminator, cases)), ("G", guid())]);
    assert_eq!(refused(Type::Float32, vec![case(0, &[1], false)]), Fault::BadDiscriminator);
    assert_eq!(refused(Type::named("G"), vec![case(0, &[1], false)]), Fault::BadDiscriminator);
    assert_eq!(refused(Type::Boolean, vec![case(0, &[2], false)]), Fault::DoesNotFit { value: 2, bits: 1 });
    assert_eq!(
        refused(Type::Octet, vec![case(0, &[1], false), case(1, &[1], false)]),
        Fault::DuplicateNumber(1)
    );
    assert_eq!(refused(Type::Octet, vec![case(0, &[1], true), case(1, &[2], true)]), Fault::TwoDefaults);
    assert_eq!(refused(Type::Octet, vec![case(0, &[], false)]), Fault::NoLabel);
    let good = union(Type::named("E"), vec![case(0, &[0], false), case(1, &[1], true)]);
    let choice = Definition::Enumeration(Enumeration::counted(["a", "b", "c"]));
    let library = finish([("U", good), ("E", choice)]).unwrap();
    let chosen = |value| library.union("U").unwrap().case_of(value).unwrap().member.id;
    assert_eq!([chosen(0), chosen(1), chosen(2)], [0, 1, 1]);
}

#[test]
fn a_name_has_one_meaning() {
    let mut draft = Draft::default();
    draft.add("a::G", guid()).unwrap();
    draft.add("a::G", guid()).unwrap();
    assert_eq!(draft.add("a::G", structure(Vec::new())).unwrap_err().fault, Fault::DefinedTwice);
    for bad in ["", "a::", "::a", "a:b", "1a", "a b", "é"] {
        assert_eq!(draft.add(bad, guid()).unwrap_err().fault, Fault::BadName, "{bad}");
    }
}
