"""Control policies, one file each: when to damp, and with what force at what velocity.

A policy is a module with what `contract.Policy` names, and one line in `registry.POLICIES`.
"""
