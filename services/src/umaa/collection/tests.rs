//! Collections against plain maps and vectors: random updates over two topics that do not wait for each other.

mod model;
mod random;

use super::*;
use aldis_envelope::Guid;
use aldis_envelope::umaa::{LargeCollectionSize, LargeListMetadata, LargeSetMetadata, ListElement};
use model::{Item, Items, at, id};

type Sets = SetProvider<Items>;
type Lists = ListProvider<Items>;
type ListUpdate = Update<ListElement<Items>, LargeListMetadata>;

/// Feeds an update: the elements, then the metadata.
fn feed<S: Shape>(reader: &mut Reader<S>, update: &Update<S::Sample, S::Metadata>) {
    elements(reader, update);
    reader.metadata(update.metadata, update.time_stamp);
}

fn elements<S: Shape>(reader: &mut Reader<S>, update: &Update<S::Sample, S::Metadata>) {
    for change in &update.elements {
        match change {
            ElementChange::Put(sample) => reader.element(sample.clone()),
            ElementChange::Dispose(id) => reader.dispose(*id),
        }
    }
}

fn values(list: &ListReader<Items>) -> Option<Vec<Item>> {
    Some(list.stable(id(100))?.map(|sample| sample.element).collect())
}

fn pushes(items: impl IntoIterator<Item = u8>) -> Vec<ListChange<Item>> {
    items.into_iter().map(|item| ListChange::Push(id(item), item)).collect()
}

fn list_of(items: impl IntoIterator<Item = u8>) -> (Lists, ListUpdate) {
    let mut list = Lists::new(id(100));
    let update = list.update(at(1), pushes(items)).unwrap().unwrap();
    (list, update)
}

fn live<S: Shape>() -> Reader<S> {
    let mut reader = Reader::new(Tell::Elements, ReaderLimits::default());
    reader.caught_up();
    reader
}

#[test]
fn an_update_ends_with_the_element_that_the_metadata_names() {
    let mut set = Sets::new(id(100));
    assert_eq!(set.metadata().update_element_id, Guid::NIL);
    let update = set.update(at(1), [1, 2, 3].map(|item| SetChange::Put(id(item), item))).unwrap().unwrap();
    let Some(ElementChange::Put(last)) = update.elements.last() else { panic!("{update:?}") };
    assert_eq!(update.metadata.update_element_id, last.element_id);
    assert_eq!(update.metadata.update_element_timestamp, Some(last.element_timestamp));
    assert!(update.metadata.size.get() == 3 && update.time_stamp > last.element_timestamp);
    assert_eq!(update.metadata, set.metadata());

    let changes = [SetChange::Put(id(4), 4), SetChange::Remove(id(1))];
    let mixed = set.update(at(2), changes).unwrap().unwrap();
    assert_eq!(mixed.elements[0], ElementChange::Dispose(id(1)));
    assert_eq!(mixed.metadata.update_element_id, id(4));

    let emptied = set.update(at(3), [2, 3, 4].map(|item| SetChange::Remove(id(item)))).unwrap().unwrap();
    let end = (emptied.metadata.update_element_timestamp, emptied.metadata.size);
    assert_eq!(end, (None, LargeCollectionSize::ZERO));
    assert_eq!(set.update(at(4), []), Ok(None));
}

#[test]
fn changes_within_one_update_count_as_one() {
    let mut set = Sets::new(id(100));
    let changes = [
        SetChange::Put(id(1), 1),
        SetChange::Put(id(1), 2),
        SetChange::Put(id(2), 3),
        SetChange::Remove(id(2)),
    ];
    let update = set.update(at(1), changes).unwrap().unwrap();
    assert_eq!(update.elements.len(), 1);
    assert_eq!(set.elements().map(|element| element.element).collect::<Vec<_>>(), [2]);

    let (mut list, _) = list_of([1, 2]);
    let back = [ListChange::Move(id(1), 1), ListChange::Move(id(1), 0)];
    assert_eq!(list.update(at(2), back), Ok(None));
}

#[test]
fn impossible_changes_leave_the_collection_as_it_was() {
    let mut set = Sets::new(id(100));
    assert_eq!(set.update(at(1), [SetChange::Put(Guid::NIL, 1)]), Err(ChangeError::Nil));
    let twice = [SetChange::Put(id(1), 1), SetChange::Remove(id(1)), SetChange::Remove(id(1))];
    assert_eq!(set.update(at(1), twice), Err(ChangeError::Missing(id(1))));
    assert_eq!(set.elements().len(), 0);

    let (mut list, _) = list_of([1, 2]);
    let metadata = list.metadata();
    for (change, why) in [
        (ListChange::Insert(3, id(3), 3), ChangeError::Position { at: 3, length: 2 }),
        (ListChange::Push(id(1), 3), ChangeError::Exists(id(1))),
        (ListChange::Push(Guid::NIL, 3), ChangeError::Nil),
        (ListChange::Replace(id(3), 3), ChangeError::Missing(id(3))),
        (ListChange::Move(id(1), 2), ChangeError::Position { at: 2, length: 1 }),
        (ListChange::Remove(id(9)), ChangeError::Missing(id(9))),
    ] {
        assert_eq!(
            list.update(at(2), [ListChange::Remove(id(2)), ListChange::Push(id(2), 9), change]),
            Err(why)
        );
    }
    assert_eq!(list.metadata(), metadata);
    assert_eq!(list.elements().map(|element| element.element).collect::<Vec<_>>(), [1, 2]);
}

#[test]
fn only_neighbours_are_sent_again() {
    let (mut list, _) = list_of(1..=9);
    let inserted = list.update(at(2), [ListChange::Insert(4, id(10), 10)]).unwrap().unwrap();
    assert_eq!(inserted.elements.len(), 2, "the new one and the one before it: {inserted:?}");
    let removed = list.update(at(3), [ListChange::Remove(id(1))]).unwrap().unwrap();
    let [ElementChange::Dispose(gone), ElementChange::Put(again)] = &removed.elements[..] else {
        panic!("{removed:?}")
    };
    assert_eq!((*gone, again.element_id), (id(1), id(2)), "put again, so that late joiners find the end");
    assert_eq!(removed.metadata.starting_element_id, id(2));
    assert_eq!(removed.metadata.update_element_timestamp, Some(again.element_timestamp));
}

#[test]
fn metadata_may_come_before_its_elements_and_after_those_of_the_next_update() {
    let (mut list, first) = list_of([1, 2, 3]);
    let second =
        list.update(at(2), [ListChange::Move(id(3), 0), ListChange::Replace(id(2), 9)]).unwrap().unwrap();

    let mut early: ListReader<Items> = live();
    early.metadata(first.metadata, first.time_stamp);
    early.metadata(second.metadata, second.time_stamp);
    assert_eq!(early.told().count(), 0);
    elements(&mut early, &first);
    assert_eq!(values(&early), Some(vec![1, 2, 3]));
    elements(&mut early, &second);
    assert_eq!(values(&early), Some(vec![3, 1, 9]));

    let mut late: ListReader<Items> = live();
    elements(&mut late, &first);
    elements(&mut late, &second);
    late.metadata(first.metadata, first.time_stamp);
    assert_eq!(values(&late), Some(vec![1, 2, 3]), "the state at the end of the first update, not a mixture");
    late.metadata(second.metadata, second.time_stamp);
    assert_eq!(values(&late), Some(vec![3, 1, 9]));
}

#[test]
fn each_element_is_told_as_it_comes_and_repetitions_are_not() {
    let (mut list, first) = list_of([1, 2]);
    let mut reader: ListReader<Items> = live();
    feed(&mut reader, &first);
    feed(&mut reader, &first);
    let told: Vec<_> = reader.told().collect();
    assert!(matches!(told[..], [Told::Changed(..), Told::Changed(..), Told::Stable(_)]), "{told:?}");
    let removed = list.update(at(2), [ListChange::Remove(id(1))]).unwrap().unwrap();
    feed(&mut reader, &removed);
    let told: Vec<_> = reader.told().collect();
    assert!(
        matches!(told[..], [Told::Removed(_, gone), Told::Changed(..), Told::Stable(_)] if gone == id(1)),
        "{told:?}"
    );
}

#[test]
fn empty_collections_are_stable() {
    let list = Lists::new(id(100));
    let mut reader: ListReader<Items> = live();
    reader.metadata(list.metadata(), at(1));
    assert_eq!(reader.told().collect::<Vec<_>>(), [Told::Stable(id(100))]);
    assert_eq!(values(&reader), Some(vec![]));
}

#[test]
fn every_kind_of_damage_is_found() {
    let (_, whole) = list_of([1, 2, 3]);
    let damage = |change: &dyn Fn(&mut Vec<_>, &mut _)| {
        let mut broken = whole.clone();
        change(&mut broken.elements, &mut broken.metadata);
        let mut reader: ListReader<Items> = live();
        feed(&mut reader, &broken);
        assert_eq!(values(&reader), None);
        let told =
            reader.told().find_map(|told| if let Told::Damaged(_, why) = told { Some(why) } else { None });
        told.expect("a damage")
    };
    let is = |change: &ElementChange<ListElement<Items>>, item| matches!(change, ElementChange::Put(put) if put.element == item);
    let relink = |elements: &mut Vec<ElementChange<_>>, index: usize, next: Option<Guid>| {
        let Some(ElementChange::Put(sample)) = elements.get_mut(index) else { panic!("no put at {index}") };
        let sample: &mut ListElement<Items> = sample;
        sample.next_element_id = next;
    };
    assert_eq!(damage(&|elements, _| elements.retain(|change| !is(change, 2))), Damage::Missing(id(2)));
    assert_eq!(damage(&|elements, _| relink(elements, 2, Some(id(1)))), Damage::Loop(id(1)));
    assert_eq!(damage(&|elements, _| relink(elements, 1, Some(id(2)))), Damage::Loop(id(2)));
    assert_eq!(damage(&|elements, _| relink(elements, 0, None)), Damage::Unreached { reached: 1, found: 3 });
    assert_eq!(
        damage(&|_, metadata| metadata.size = LargeCollectionSize::new(4).unwrap()),
        Damage::Size { expected: 4, found: 3 }
    );
    assert_eq!(damage(&|_, metadata| metadata.starting_element_id = id(7)), Damage::Missing(id(7)));
}

#[test]
fn a_damaged_list_is_whole_again_after_its_history_has_been_read() {
    let (mut list, first) = list_of([1, 2, 3]);
    let mut reader: ListReader<Items> = live();
    feed(&mut reader, &first);
    let mut second = list.update(at(2), [ListChange::Move(id(3), 0)]).unwrap().unwrap();
    let lost = second.elements.remove(0);
    feed(&mut reader, &second);
    assert!(matches!(reader.told().last(), Some(Told::Damaged(..))), "without {lost:?}");

    reader.gap();
    list.elements().for_each(|element| reader.element(element.clone()));
    reader.caught_up();
    assert_eq!(values(&reader), Some(vec![3, 1, 2]));
}

#[test]
fn what_went_during_a_gap_is_told_at_the_next_stable_state() {
    let mut set = Sets::new(id(100));
    let first = set.update(at(1), [1, 2].map(|item| SetChange::Put(id(item), item))).unwrap().unwrap();
    let mut reader: SetReader<Items> = live();
    feed(&mut reader, &first);
    let second = set.update(at(2), [SetChange::Remove(id(1)), SetChange::Put(id(3), 3)]).unwrap().unwrap();
    reader.told().for_each(drop);

    reader.gap();
    reader.metadata(second.metadata, second.time_stamp);
    set.elements().for_each(|element| reader.element(element.clone()));
    let told: Vec<_> = reader.told().collect();
    assert!(
        matches!(&told[..], [Told::Changed(_, new), Told::Removed(_, gone), Told::Stable(_)]
            if new.element_id == id(3) && *gone == id(1)),
        "{told:?}"
    );
}

#[test]
fn a_late_joiner_cannot_mistake_half_an_update_for_a_whole_one() {
    let mut set = Sets::new(id(100));
    set.update(at(1), [1, 2].map(|item| SetChange::Put(id(item), item))).unwrap();
    // Another provider's way: element 3 has come and gone, and nothing else was sent.
    let (update_element_id, update_element_timestamp) = (id(3), None);
    let gone = LargeSetMetadata { update_element_id, update_element_timestamp, ..set.metadata() };
    let quiet: Vec<_> = set.elements().cloned().collect();
    let half = set.update(at(4), [1, 2].map(|item| SetChange::Put(id(item), item + 10))).unwrap().unwrap();

    // Nothing else has happened: the disposal is in the past, and the set is whole.
    let mut reader: SetReader<Items> = Reader::new(Tell::States, ReaderLimits::default());
    reader.metadata(gone, at(3));
    quiet.iter().for_each(|element| reader.element(element.clone()));
    assert_eq!(reader.told().count(), 0, "the history may go on");
    reader.caught_up();
    assert_eq!(reader.told().collect::<Vec<_>>(), [Told::Stable(id(100))]);

    // The next update has begun: as many elements, but one of them is newer than the report.
    let mut reader: SetReader<Items> = Reader::new(Tell::States, ReaderLimits::default());
    reader.metadata(gone, at(3));
    reader.element(quiet[1].clone());
    let ElementChange::Put(newer) = half.elements[0].clone() else { panic!("{half:?}") };
    reader.element(newer);
    reader.caught_up();
    assert_eq!(reader.told().count(), 0);
    let ElementChange::Put(last) = half.elements[1].clone() else { panic!("{half:?}") };
    reader.element(last);
    reader.metadata(half.metadata, half.time_stamp);
    assert!(!reader.wants_history());
    assert_eq!(reader.told().collect::<Vec<_>>(), [Told::Stable(id(100))]);
}

#[test]
fn limits_are_kept_and_told() {
    let (_, update) = list_of([1, 2, 3]);
    let mut reader: ListReader<Items> =
        Reader::new(Tell::States, ReaderLimits { elements: 2, collections: 1 });
    reader.caught_up();
    feed(&mut reader, &update);
    let told: Vec<_> = reader.told().collect();
    assert!(
        matches!(told[..], [Told::Shed(collection, element)] if collection == id(100) && element == id(3)),
        "{told:?}"
    );
    let other = Lists::new(id(101));
    reader.metadata(other.metadata(), at(1));
    assert_eq!(reader.told().collect::<Vec<_>>(), [Told::Shed(id(101), Guid::NIL)]);
    reader.gone(id(100));
    assert_eq!(reader.told().collect::<Vec<_>>(), [Told::Gone(id(100))]);
    reader.metadata(other.metadata(), at(1));
    assert_eq!(reader.told().collect::<Vec<_>>(), [Told::Stable(id(101))]);
}

#[test]
fn a_provider_goes_on_where_its_former_life_ended() {
    let (mut list, first) = list_of([1, 2, 3]);
    let moved = list.update(at(9), [ListChange::Move(id(1), 2)]).unwrap().unwrap();
    let mut again = Lists::recovered(list.metadata(), list.elements().cloned()).unwrap();
    let mut reader: ListReader<Items> = live();
    feed(&mut reader, &first);
    feed(&mut reader, &moved);
    let third = again.update(at(2), [ListChange::Remove(id(3))]).unwrap().unwrap();
    assert!(third.time_stamp > moved.time_stamp, "the clock stands at 2, the former life's at 9");
    feed(&mut reader, &third);
    assert_eq!(values(&reader), Some(vec![2, 1]));
    let half = list.elements().skip(1).cloned();
    assert_eq!(Lists::recovered(list.metadata(), half).unwrap_err(), Damage::Missing(id(2)));
}

#[test]
fn an_unended_update_of_any_length_is_held_within_bounds() {
    let mut set = Sets::new(id(100));
    let first = set.update(at(1), [SetChange::Put(id(1), 0)]).unwrap().unwrap();
    let mut reader: SetReader<Items> = live();
    feed(&mut reader, &first);
    for round in 0..25_000_u32 {
        let value = (round % 251) as u8;
        let update = set.update(at(2), [SetChange::Put(id(1), value)]).unwrap().unwrap();
        elements(&mut reader, &update);
    }
    assert!(reader.stable(id(100)).is_none());
    let last = set.update(at(3), [SetChange::Put(id(2), 7)]).unwrap().unwrap();
    feed(&mut reader, &last);
    assert_eq!(reader.stable(id(100)).unwrap().len(), 2);
}
