"""A running cell as an observer sees it: who lives, what the memory shows, orders to its PLC."""
