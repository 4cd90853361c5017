#include "protocol/fold_json.hpp"

#include "protocol/fold_members.hpp"
#include "protocol/json_writer.hpp"
#include "protocol/member_writer.hpp"

namespace splid {

std::string to_json(const FoldMessage& message) {
  JsonWriter json = message_head("splid.fold", message.timestamp_s, message.sequence);
  MemberWriter writer(json);
  describe(message, writer);
  return json.finish();
}

}  // namespace splid
