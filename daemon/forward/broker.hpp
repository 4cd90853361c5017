#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/forward/message.hpp"

namespace splid::forward {

// Where messages go, and with what rights.
struct Destination {
  bool is_nats = false;  // else MQTT
  std::string host;
  int port = 0;
  std::string device;  // part of each topic: splid/DEVICE/TOPIC, splid.DEVICE.TOPIC
  std::string user;    // empty: none
  std::string password;
  std::string nats_creds;   // file with a NATS user's JWT and key; empty: none
  std::string ca;           // file of certificates; not empty: TLS
  std::string certificate;  // of this client; empty: none
  std::string private_key;
};

// Of mqtt://HOST[:PORT] or nats://HOST[:PORT]; the port may be left out (1883, with TLS 8883;
// 4222).
//
// Errors: Error(Fault::usage).
Destination parse_destination(const std::string& to, bool has_tls);

// credentials: a file with USER:PASSWORD in its first line, or a file of NATS credentials.
//
// Errors: Error(Fault::usage) for a file that others may read, or that is neither.
void read_credentials(const std::string& file, Destination& destination);

// A broker, connected or not.
//
// Threads: one. Errors: none is thrown; each is a sentence in the outcome.
class Broker {
 public:
  struct Outcome {
    std::size_t done = 0;              // so many of the first are done with
    std::vector<std::size_t> refused;  // of these, those that the broker never takes
    std::string fault;                 // empty: connected, and all are done
  };

  virtual ~Broker() = default;

  // Connects if it has to, hands the messages over in order and waits for the broker's
  // acknowledgements. What is not done is given again. Called often, with nothing too: a connection
  // needs its heartbeats. Returns within some 5 s.
  virtual Outcome carry(std::span<const Message> batch) = 0;
};

std::unique_ptr<Broker> open_mqtt(const Destination& destination);
std::unique_ptr<Broker> open_nats(const Destination& destination);

}  // namespace splid::forward
