// HID surfaces over hidapi (its hidraw backend). Every device has a thread of its own that reads and writes it, because
// hidapi gives no descriptor to wait for; what it reads comes to the device thread through a queue.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/surfaces/wire.h"

namespace gonio {

// wanted: "vvvv:pppp" of devices that are surfaces because somebody says so. wake: any thread.
std::unique_ptr<Backend> make_hid_backend(std::vector<std::string> wanted, std::function<void()> wake);

}  // namespace gonio
