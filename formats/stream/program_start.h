#pragma once
// What a program does before all else, and what remains to be done where it ends suddenly. For
// programs only: a library leaves its caller's streams, names and signals alone.

namespace gewebe::formats {

/// Opens standard input, output and error where they are closed, so that no file takes their place;
/// to use them is an error nevertheless. Before anything else is opened.
void hold_standard_streams();

/// Removes the temporary files of all Outputs, as the signal handlers do (stream.h).
void remove_temporaries() noexcept;

} // namespace gewebe::formats
