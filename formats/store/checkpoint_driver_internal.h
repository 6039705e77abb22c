#pragma once
// HDF5 file driver with atomic checkpoints: whatever ends the program or fills the disk, the file
// holds its state at the last checkpoint.
//
// Changes of what the last checkpoint holds are kept in memory, in pages; everything else goes to
// the disk at once. A checkpoint
//   1. allocates the disk's blocks for all of the file, and some behind its end,
//   2. writes the changed pages behind the file's end, and where they are, with their digest, to
//      the last bytes of all: the redo log,
//   3. writes them in place,
//   4. overwrites the log's last bytes by zeros.
// A program that is killed before 2 ends leaves the checkpoint before; one that is killed later
// leaves a redo log, which `restore_checkpoint` carries out. A full disk can stop it in 1 and 2
// alone. The superblock on the disk never says that the file is open for writing, so every HDF5
// reader can open it.

#include <cstdint>
#include <string>

namespace gewebe::formats::hdf5 {

/// Properties of a file access (H5P_FILE_ACCESS) get this driver. \return false if HDF5 refuses
bool use_checkpoints(std::int64_t access);

/// All that HDF5 has flushed becomes the file's state. \param file an HDF5 file with this driver
/// \return 0, or the errno of what failed: the file then holds the checkpoint before
int make_checkpoint(std::int64_t file);

/// Whatever HDF5 writes from now on is dropped, so that it can be closed without a change.
void discard_writes(std::int64_t file);

/// The file is as its last checkpoint left it, its redo log is carried out.
/// \return 0, or the errno of what failed
int restore_checkpoint(const std::string& path);

} // namespace gewebe::formats::hdf5
