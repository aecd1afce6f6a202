// What a client may hear from a server that is not one: messages in both encodings and headers of video.
#include "tests/fuzz/message_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    gonio::fuzz::check_server_bytes({reinterpret_cast<const char*>(data), size});
    return 0;
}
