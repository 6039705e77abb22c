#include "tools/serve/local_socket.h"

#include "base/error.h"
#include "formats/stream/removal.h"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <pwd.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace gewebe::cli {

namespace {

constexpr int waiting_clients = 16; // until they are let in or turned away

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    throw Error(path, "a name of " + std::to_string(path.size()) +
                          " bytes for a socket, expected 1 to " +
                          std::to_string(sizeof address.sun_path - 1));
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  return address;
}

[[noreturn]] void fail(const std::string& path, const char* what) {
  throw Error(path, std::string(what) + ": " + std::strerror(errno));
}

/// Removes a socket without a listener. \throw Error if there is one, or it is no socket
void remove_stale(const std::string& path, const sockaddr_un& address) {
  struct stat info {};
  if (::lstat(path.c_str(), &info) != 0)
    return; // bind reports what is wrong
  if (!S_ISSOCK(info.st_mode))
    throw Error(path, "is there and is no socket, expected another name");
  const formats::Descriptor probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!probe)
    fail(path, "cannot make a socket");
  if (::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ||
      errno == EAGAIN)
    throw Error(path, "another program listens there, expected another name");
  if (errno == ENOENT)
    return;
  if (errno != ECONNREFUSED)
    fail(path, "is there and cannot be looked at");
  if (::unlink(path.c_str()) != 0 && errno != ENOENT)
    fail(path, "no process listens there, but it cannot be removed");
}

/// Renames a file and replaces none, where the file system can do that.
bool rename_to_new(const std::string& from, const std::string& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0)
    return true;
  return (errno == EINVAL || errno == ENOSYS) && ::rename(from.c_str(), to.c_str()) == 0;
}

/// One that can be had at any time but must not be used for anything.
formats::Descriptor spare_descriptor() {
  return formats::Descriptor(::open("/dev/null", O_RDONLY | O_CLOEXEC));
}

std::string user_name(uid_t user) {
  std::array<char, 4096> memory{};
  passwd entry{};
  passwd* found = nullptr;
  const bool known =
      ::getpwuid_r(user, &entry, memory.data(), memory.size(), &found) == 0 && found != nullptr;
  return (known ? std::string(entry.pw_name) + " " : "") + "(" + std::to_string(user) + ")";
}

} // namespace

LocalListener::LocalListener(const std::string& path) : path_(path), spare_(spare_descriptor()) {
  const sockaddr_un address = address_of(path);
  const formats::Descriptor lock = formats::lock_folder_of(path);
  remove_stale(path, address);
  // Clients that find the path must be able to connect, so the socket listens under another name
  // first. A name that is too long for that is bound at once.
  const bool long_name = path.size() + 1 >= sizeof address.sun_path;
  const std::string first = long_name ? path : path + "~";
  const sockaddr_un first_address = address_of(first);
  remove_stale(first, first_address);
  socket_ = formats::Descriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  // Linux gives the path the mode of the socket, so that it is never open to others.
  if (!socket_ || ::fchmod(socket_.get(), 0600) != 0)
    fail(path, "cannot make a socket");
  const formats::SignalsWait wait;
  if (::bind(socket_.get(), reinterpret_cast<const sockaddr*>(&first_address),
             sizeof first_address) != 0)
    fail(path, "cannot listen there");
  struct stat info {};
  const bool seen = ::lstat(first.c_str(), &info) == 0;
  device_ = info.st_dev;
  file_ = info.st_ino;
  if (seen && (info.st_mode & 0077U) == 0 && ::listen(socket_.get(), waiting_clients) == 0 &&
      (long_name || rename_to_new(first, path))) {
    removal_ = formats::remember_removal(path);
    return;
  }
  const int error = errno;
  (void)::unlink(first.c_str());
  errno = error;
  fail(path, "cannot listen there for its owner alone");
}

LocalListener::~LocalListener() {
  formats::forget_removal(removal_);
  struct stat info {}; // what another has put there stays
  if (::lstat(path_.c_str(), &info) == 0 && info.st_dev == device_ && info.st_ino == file_)
    (void)::unlink(path_.c_str());
}

LocalListener::Arrival LocalListener::accept() {
  if (!spare_)
    spare_ = spare_descriptor();
  const auto next = [&] {
    return formats::Descriptor(
        ::accept4(socket_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  };
  Arrival arrival{next()};
  const int error = arrival.client ? 0 : errno;
  if (error == ENOBUFS || error == ENOMEM)
    fail(path_, "cannot let a client in");
  if (error != EMFILE && error != ENFILE)
    return arrival; // or there is none, or none that waits still
  arrival.refusal = std::string("no file descriptor is left for a client, expected fewer open "
                                "files or a higher limit: ") +
                    std::strerror(error);
  spare_ = formats::Descriptor();
  arrival.client = next();
  if (!arrival.client && errno != EAGAIN)
    fail(path_, "no file descriptor is left to turn a client away");
  if (!arrival.client) // no client waits, which is seen with a descriptor alone
    spare_ = spare_descriptor();
  return arrival;
}

std::optional<std::string> foreign_peer(const formats::Descriptor& client) {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (::getsockopt(client.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0)
    return "an unknown user may not drive the scene";
  if (peer.uid == ::geteuid())
    return std::nullopt;
  return "user " + user_name(peer.uid) + " may not drive the scene, expected " +
         user_name(::geteuid());
}

Transfer send_some(const formats::Descriptor& to, std::string& bytes) {
  std::size_t done = 0;
  Transfer result = Transfer::none_now;
  while (done < bytes.size()) {
    const ssize_t count = ::send(to.get(), bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR)
      continue;
    if (count < 0) {
      if (errno != EAGAIN && errno != EWOULDBLOCK)
        return Transfer::over;
      break;
    }
    done += static_cast<std::size_t>(count);
    result = Transfer::some;
  }
  bytes.erase(0, done);
  return result;
}

Received receive_some(const formats::Descriptor& from, std::span<char> buffer) {
  ssize_t count = 0;
  do
    count = ::recv(from.get(), buffer.data(), buffer.size(), 0);
  while (count < 0 && errno == EINTR);
  if (count > 0)
    return {Transfer::some, {buffer.data(), static_cast<std::size_t>(count)}};
  const bool later = count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK);
  return {later ? Transfer::none_now : Transfer::over};
}

} // namespace gewebe::cli
