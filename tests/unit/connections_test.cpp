#include "server/serve/connections.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

namespace intervale {
namespace {

// Notes its end, and does not leave by itself.
class NotingConnection : public Connection {
 public:
  NotingConnection(std::string& aborted, char name) : aborted_(aborted), name_(name) {}
  void begin_shutdown() override {}
  void abort(const char* /*why*/) override { aborted_ += name_; }

 private:
  std::string& aborted_;
  char name_;
};

class ConnectionsTest : public ::testing::Test {
 protected:
  Connections::Registration& add(char name) {
    alive_.push_back(std::make_shared<NotingConnection>(aborted_, name));
    return registrations_.emplace_back(connections_.add(alive_.back()));
  }
  std::string aborted_;
  std::vector<std::shared_ptr<Connection>> alive_;
  Connections connections_;
  std::vector<Connections::Registration> registrations_;
};

TEST_F(ConnectionsTest, MakeRoomByAbortingTheOneThatWaitsLongest) {
  registrations_.reserve(5);
  auto& a = add('a');
  add('b');
  auto& c = add('c');
  EXPECT_TRUE(connections_.make_room(4));
  EXPECT_EQ(aborted_, "") << "there was room";
  add('d');
  connections_.set_waiting(a, false);
  EXPECT_TRUE(connections_.make_room(4));
  EXPECT_EQ(aborted_, "b") << "a does not wait";
  connections_.set_waiting(c, true);  // again: at the end
  EXPECT_TRUE(connections_.make_room(4));
  EXPECT_TRUE(connections_.make_room(4));
  EXPECT_EQ(aborted_, "bdc");
  EXPECT_FALSE(connections_.make_room(4)) << "nobody waits who was not told to leave";
  connections_.set_waiting(a, true);
  EXPECT_TRUE(connections_.make_room(4));
  EXPECT_EQ(aborted_, "bdca");
}

TEST_F(ConnectionsTest, ThatLeaveDoNotWait) {
  registrations_.reserve(2);
  add('a');
  add('b');
  registrations_.erase(registrations_.begin());
  EXPECT_TRUE(connections_.make_room(1));
  EXPECT_EQ(aborted_, "b");
}

TEST_F(ConnectionsTest, AreNotManyMoreThanAllowedWhileTheyAreTornDown) {
  registrations_.reserve(200);
  int added = 0;
  while (added < 200 && connections_.make_room(10)) {
    add('x');
    ++added;
  }
  EXPECT_EQ(added, 10 + 64);
}

}  // namespace
}  // namespace intervale
