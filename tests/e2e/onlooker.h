// Somebody who looks.
#pragma once

#include <thread>

#include "tests/e2e/daemon_process.h"

namespace gonio::test {

// Lets pictures be encoded, until the daemon is stopped, which its end does.
class Onlooker {
public:
    explicit Onlooker(DaemonProcess& daemon)
        : daemon_(daemon), thread_([url = daemon.url()] {
              run_program("gonio", {"--server", url, "watch"});
          }) {}
    ~Onlooker() {
        daemon_.stop();
        thread_.join();
    }
    Onlooker(const Onlooker&) = delete;
    Onlooker& operator=(const Onlooker&) = delete;

private:
    DaemonProcess& daemon_;
    std::thread thread_;
};

}  // namespace gonio::test
