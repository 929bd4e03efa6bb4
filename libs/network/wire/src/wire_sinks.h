// The networks there are. Private to libs/network/wire.
#pragma once
#include "osteo/network/wire/server.h"
#include "osteo/network/wire/stream_feed.h"

namespace osteo::inline network {

/// OpenIGTLink, a server.
[[nodiscard]] std::unique_ptr<WireSink> make_igtl_sink(const StreamTarget& target);
/// Packets of Blackrock's signal processors, over UDP.
[[nodiscard]] std::unique_ptr<WireSink> make_cerebus_sink(const StreamTarget& target);
/// Lab Streaming Layer, by its library where it is installed. Error(failed) where it is not.
[[nodiscard]] std::unique_ptr<WireSink> make_lsl_sink();

}  // namespace osteo::inline network
