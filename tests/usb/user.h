// The project's own input code in a process of its own, as a user without rights beyond the group gonio.
#pragma once

#include <sys/types.h>

#include <map>
#include <string>

namespace gonio::test {

class User {
public:
    explicit User(bool alsa = false);  // uid 1000, groups gonio only; alsa: MIDI by raw ports instead of by both ways
    ~User();                           // ends the process
    User(const User&) = delete;

    // Result: whether the device came to this state by this transport within the time; error() says what the table said
    // last.
    bool device_is(const std::string& identity, const std::string& transport, const std::string& state,
                   int timeout_ms = 6000);
    std::string error(const std::string& identity, const std::string& transport) const;
    // Result: whether the control said this value, of those not yet asked for, within 3 s. Clicks are summed.
    bool heard(const std::string& control, double value);
    // While the process stands still nothing is read or sent: until the box's side is ready.
    void pause() const;
    void resume() const;
    void fail_output(bool fails) const;  // whether libusb refuses to send
    double last(const std::string& control) const;
    void show(const std::string& identity, const std::string& control, double value);
    unsigned moved() const { return moved_; }  // lines about controls so far
    void listen(int ms);                       // takes what comes within the time

private:
    bool read_lines(int timeout_ms);
    pid_t pid_ = -1;
    int socket_ = -1;
    std::string buffer_;
    std::map<std::string, std::string> devices_;  // "identity transport" -> "state error"
    std::map<std::string, double> values_;
    unsigned moved_ = 0;
};

}  // namespace gonio::test
