//! The copy of the state to which a shoot returns after an error.

use super::IntegrationError;
use crate::model::Model;
use crate::shoot::Shoot;
use crate::state::State;

/// Calls `work` with the shoot and a copy of its state. If `work` fails, the shoot returns to that state. The memory of the copy
/// stays in `backup` and serves the next call.
pub(super) fn undo_on_error<M: Model, T>(
    shoot: &mut Shoot<M>,
    backup: &mut Option<State>,
    work: impl FnOnce(&mut Shoot<M>, &State) -> Result<T, IntegrationError>,
) -> Result<T, IntegrationError> {
    let before = backup.get_or_insert_with(|| shoot.state.clone());
    before.copy_from(&shoot.state);
    let answer = work(shoot, before);
    if answer.is_err() {
        shoot.state.copy_from(before);
    }
    answer
}
