// Runs a program whose UTC is shifted, as of a machine at another time:
//
//   shifted_clock SECONDS PROGRAM ARGUMENT...
//
// A child takes the program's questions for the time from the kernel (seccomp's notifications) and
// answers them. Programs that read the clock without asking the kernel are made to ask: the child
// hides the page that they read it from. Exit code: the program's; 127 where this cannot be done.

#include <elf.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

namespace {

[[noreturn]] void fail(const char* what) {
  std::perror(what);
  std::_Exit(127);
}

// The descriptor of what asks for CLOCK_REALTIME, in this process and after its exec, which closes
// this descriptor.
int listen_for_questions() {
  std::array<sock_filter, 6> steps = {{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_clock_gettime, 0, 3),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, args)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, CLOCK_REALTIME, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_USER_NOTIF),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
  }};
  const sock_fprog filter = {steps.size(), steps.data()};
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) fail("shifted_clock: no new privileges");
  const long listener =
      syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_NEW_LISTENER, &filter);
  if (listener < 0) fail("shifted_clock: seccomp");
  return static_cast<int>(listener);
}

// A message of one byte with room for a descriptor. By a socket, since many containers forbid
// pidfd_getfd().
struct DescriptorMessage {
  DescriptorMessage() {
    header.msg_iov = &part;
    header.msg_iovlen = 1;
    header.msg_control = room.data();
    header.msg_controllen = room.size();
  }
  char byte = 0;
  iovec part = {&byte, 1};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> room{};
  msghdr header{};
};

void send_descriptor(int socket, int descriptor) {
  DescriptorMessage message;
  cmsghdr* rights = CMSG_FIRSTHDR(&message.header);
  rights->cmsg_level = SOL_SOCKET;
  rights->cmsg_type = SCM_RIGHTS;
  rights->cmsg_len = CMSG_LEN(sizeof descriptor);
  std::memcpy(CMSG_DATA(rights), &descriptor, sizeof descriptor);
  if (sendmsg(socket, &message.header, 0) != 1) fail("shifted_clock: sendmsg");
}

int receive_descriptor(int socket) {
  DescriptorMessage message;
  if (recvmsg(socket, &message.header, 0) != 1) fail("shifted_clock: recvmsg");
  const cmsghdr* rights = CMSG_FIRSTHDR(&message.header);
  if (rights == nullptr) fail("shifted_clock: no descriptor");
  int descriptor = -1;
  std::memcpy(&descriptor, CMSG_DATA(rights), sizeof descriptor);
  return descriptor;
}

// A word of the program's memory, which is read or written.
void transfer(pid_t program, std::uintptr_t place, void* own, std::size_t size, bool writes) {
  const iovec here = {own, size};
  const iovec there = {reinterpret_cast<void*>(place), size};
  const ssize_t done = writes ? process_vm_writev(program, &here, 1, &there, 1, 0)
                              : process_vm_readv(program, &here, 1, &there, 1, 0);
  if (done != static_cast<ssize_t>(size)) fail("shifted_clock: the program's memory");
}

// In the words behind the arguments and the environment, where the kernel says what there is.
void hide_clock_page(pid_t program) {
  std::ifstream file("/proc/" + std::to_string(program) + "/stat");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  std::istringstream fields(text.substr(text.rfind(')') + 2));
  std::string field;
  for (int i = 3; i <= 28; ++i) fields >> field;  // startstack
  std::uintptr_t at = std::stoull(field);
  const auto next = [&] {
    std::uintptr_t word = 0;
    transfer(program, at, &word, sizeof word, false);
    at += sizeof word;
    return word;
  };
  at += (next() + 1) * sizeof(std::uintptr_t);  // the arguments
  while (next() != 0) {
  }
  for (std::uintptr_t kind = next(); kind != AT_NULL; next(), kind = next()) {
    std::uintptr_t ignored = AT_IGNORE;
    if (kind == AT_SYSINFO_EHDR) transfer(program, at - sizeof at, &ignored, sizeof ignored, true);
  }
}

void answer(int listener, std::int64_t shift_s) {
  for (;;) {
    pollfd state = {listener, POLLIN, 0};
    if (poll(&state, 1, -1) < 0 || (state.revents & POLLIN) == 0) return;  // the program has ended
    seccomp_notif question = {};
    if (ioctl(listener, SECCOMP_IOCTL_NOTIF_RECV, &question) != 0) continue;
    timespec now = {};
    clock_gettime(CLOCK_REALTIME, &now);
    now.tv_sec += shift_s;
    transfer(static_cast<pid_t>(question.pid), question.data.args[1], &now, sizeof now, true);
    seccomp_notif_resp reply = {};
    reply.id = question.id;
    ioctl(listener, SECCOMP_IOCTL_NOTIF_SEND, &reply);
  }
}

// The child: waits for the exec, and then for questions.
[[noreturn]] void serve(pid_t program, int socket, std::int64_t shift_s) {
  if (ptrace(PTRACE_SEIZE, program, nullptr, PTRACE_O_TRACEEXEC) != 0) {
    fail("shifted_clock: ptrace");
  }
  if (write(socket, "", 1) != 1) fail("shifted_clock: socket");
  const int listener = receive_descriptor(socket);
  close(socket);
  int status = 0;
  if (waitpid(program, &status, 0) != program ||
      status >> 8 != (SIGTRAP | PTRACE_EVENT_EXEC << 8)) {
    fail("shifted_clock: no exec");
  }
  hide_clock_page(program);
  ptrace(PTRACE_DETACH, program, nullptr, nullptr);
  answer(listener, shift_s);
  std::_Exit(0);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: shifted_clock SECONDS PROGRAM ARGUMENT...\n");
    return 2;
  }
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    fail("shifted_clock: socketpair");
  }
  const pid_t program = getpid();
  if (fork() == 0) {
    close(ends[0]);
    serve(program, ends[1], std::atoll(argv[1]));
  }
  close(ends[1]);
  char byte = 0;
  if (read(ends[0], &byte, 1) != 1) return 127;
  send_descriptor(ends[0], listen_for_questions());
  execv(argv[2], argv + 2);
  fail(argv[2]);
}
