//! Things by number or by name: every further type of map costs the page kilobytes, hence two for all readers.

use std::borrow::Borrow;
use std::collections::BTreeMap;

/// Values by key, in the order of the keys.
#[derive(Clone, Debug)]
pub(crate) struct Register<K, V> {
    places: BTreeMap<K, usize>,
    values: Vec<V>,
}

/// Values by number.
pub(crate) type Numbered<V> = Register<u64, V>;
/// Values by name.
pub(crate) type Named<V> = Register<String, V>;

impl<K, V> Default for Register<K, V> {
    fn default() -> Self {
        Self { places: BTreeMap::new(), values: Vec::new() }
    }
}

impl<K: Ord, V> Register<K, V> {
    pub fn len(&self) -> usize {
        self.values.len()
    }

    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    pub fn contains<Q: Ord + ?Sized>(&self, key: &Q) -> bool
    where
        K: Borrow<Q>,
    {
        self.places.contains_key(key)
    }

    pub fn get<Q: Ord + ?Sized>(&self, key: &Q) -> Option<&V>
    where
        K: Borrow<Q>,
    {
        self.values.get(*self.places.get(key)?)
    }

    pub fn get_mut<Q: Ord + ?Sized>(&mut self, key: &Q) -> Option<&mut V>
    where
        K: Borrow<Q>,
    {
        self.values.get_mut(*self.places.get(key)?)
    }

    /// Put a value in place of the one that has its key, if any; false where there was one.
    pub fn insert(&mut self, key: K, value: V) -> bool {
        match self.places.get(&key) {
            Some(&place) => self.values[place] = value,
            None => {
                self.places.insert(key, self.values.len());
                self.values.push(value);
                return true;
            }
        }
        false
    }

    /// The value of a key, made where there is none.
    pub fn entry(&mut self, key: K, make: impl FnOnce() -> V) -> &mut V {
        let next = self.values.len();
        let place = *self.places.entry(key).or_insert(next);
        if place == next {
            self.values.push(make());
        }
        &mut self.values[place]
    }

    /// The values, in the order in which their keys came.
    pub fn values_mut(&mut self) -> std::slice::IterMut<'_, V> {
        self.values.iter_mut()
    }

    /// The values, in the order in which their keys came.
    pub fn values(&self) -> std::slice::Iter<'_, V> {
        self.values.iter()
    }

    pub fn keys(&self) -> impl Iterator<Item = &K> {
        self.places.keys()
    }

    /// Keys and values, in the order of the keys.
    pub fn into_sorted(self) -> impl Iterator<Item = (K, V)> {
        let mut values: Vec<Option<V>> = self.values.into_iter().map(Some).collect();
        self.places.into_iter().filter_map(move |(key, place)| Some((key, values[place].take()?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catches values that change places when a key comes again, and an order that is that of their coming.
    #[test]
    fn values_are_found_by_their_keys_and_come_out_in_their_order() {
        let mut r = Numbered::default();
        assert!(r.insert(7, 'a') && r.insert(3, 'b') && !r.insert(7, 'c'));
        assert_eq!(*r.entry(3, || 'x'), 'b');
        assert_eq!(*r.entry(5, || 'd'), 'd');
        *r.get_mut(&5).unwrap() = 'e';
        assert!(r.contains(&5) && !r.contains(&4) && r.len() == 3 && !r.is_empty());
        assert_eq!(r.into_sorted().collect::<Vec<_>>(), [(3, 'b'), (5, 'e'), (7, 'c')]);
        let mut named = Named::default();
        named.insert("x".to_owned(), 1);
        assert_eq!((named.get("x"), named.get("y")), (Some(&1), None));
    }
}
