//! Restoration of the state of a shoot after an error.

use super::error::Outcome;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::State;

/// Calls `work` with the shoot and a copy of its state. Restores this state if `work` fails. The
/// memory of the copy stays in `backup` for the next call.
pub(super) fn undo_on_error<M: Model, T>(
    shoot: &mut Shoot<M>,
    backup: &mut Option<State>,
    work: impl FnOnce(&mut Shoot<M>, &State) -> Outcome<T>,
) -> Outcome<T> {
    let before = backup.get_or_insert_with(|| shoot.state.clone());
    before.copy_from(&shoot.state);
    work(shoot, before).inspect_err(|_| shoot.state.copy_from(before))
}
