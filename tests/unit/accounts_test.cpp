#include "server/serve/accounts.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

namespace intervale {
namespace {

using namespace std::chrono_literals;

boost::asio::ip::address address(const std::string& text) { return boost::asio::ip::make_address(text); }

TEST(Accounts, AreSharedByAnAddressOrAToken) {
  FairScheduler scheduler(2);
  Accounts accounts(scheduler);
  const auto one = accounts.of_address(address("192.0.2.1"));
  EXPECT_EQ(one, accounts.of_address(address("192.0.2.1")));
  EXPECT_EQ(one, accounts.of_address(address("::ffff:192.0.2.1")));
  EXPECT_NE(one, accounts.of_address(address("192.0.2.2")));
  EXPECT_EQ(accounts.of_address(address("2001:db8:1:2::1")), accounts.of_address(address("2001:db8:1:2:3::9")));
  EXPECT_NE(accounts.of_address(address("2001:db8:1:2::1")), accounts.of_address(address("2001:db8:1:3::1")));
  EXPECT_EQ(accounts.of_token("secret"), accounts.of_token("secret"));
  EXPECT_NE(accounts.of_token("secret"), accounts.of_token("other"));
  EXPECT_NE(accounts.of_token("secret"), one);
}

TEST(Accounts, AreKeptUntilWhatTheySpentIsForgotten) {
  FairScheduler scheduler(2);
  Accounts accounts(scheduler);
  scheduler.charge(*accounts.of_token("spender"), 5s);
  for (int i = 0; i < 10000; ++i) (void)accounts.of_token("guest" + std::to_string(i));
  EXPECT_LE(accounts.size(), 200u);
  EXPECT_GT(scheduler.spent(*accounts.of_token("spender")), 4s);
  EXPECT_LT(scheduler.spent(*accounts.of_token("guest1")), 1ms);
}

TEST(TrustedProxies, TellWhoseHeaderIsBelieved) {
  const auto proxies = TrustedProxies::parse(std::vector<std::string>{"10.0.0.0/8", "127.0.0.1", "fd00::/9"});
  ASSERT_TRUE(proxies);
  for (const char* const trusted : {"10.1.2.3", "127.0.0.1", "::ffff:10.9.9.9", "fd7f::1"})
    EXPECT_TRUE(proxies->contains(address(trusted))) << trusted;
  for (const char* const other : {"11.1.2.3", "127.0.0.2", "fd80::1", "::1"}) EXPECT_FALSE(proxies->contains(address(other))) << other;
  EXPECT_FALSE(TrustedProxies().contains(address("127.0.0.1")));
  for (const char* const wrong : {"", "proxy", "10.0.0.0/33", "10.0.0.0/", "10.0.0.0/-1", "::/129", "10.0.0.0/8x"}) {
    EXPECT_FALSE(TrustedProxies::parse(std::vector<std::string>{wrong})) << wrong;
  }
}

TEST(TrustedProxies, TheClientIsTheLastAddressThatIsNoProxys) {
  const auto proxies = TrustedProxies::parse(std::vector<std::string>{"10.0.0.0/8"});
  ASSERT_TRUE(proxies);
  const auto client = [&](const char* peer, std::string_view header) { return proxies->client(address(peer), header).to_string(); };
  EXPECT_EQ(client("10.0.0.1", "192.0.2.7"), "192.0.2.7");
  EXPECT_EQ(client("10.0.0.1", "198.51.100.1, 192.0.2.7 , 10.3.0.1"), "192.0.2.7") << "what comes before, the client made up";
  EXPECT_EQ(client("10.0.0.1", "2001:db8::5"), "2001:db8::5");
  EXPECT_EQ(client("192.0.2.1", "198.51.100.1"), "192.0.2.1") << "no proxy may say so";
  EXPECT_EQ(client("10.0.0.1", ""), "10.0.0.1");
  EXPECT_EQ(client("10.0.0.1", "192.0.2.7, unknown"), "10.0.0.1");
  EXPECT_EQ(client("10.0.0.1", ",,,"), "10.0.0.1");
}

}  // namespace
}  // namespace intervale
