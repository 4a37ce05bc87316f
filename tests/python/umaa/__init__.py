"""UMAA Support Operations over Aldis's wire format, for a peer that shares no code with Aldis.

Written from the ICD (5.2.1) and `envelope/WIRE.md` alone. Low to high: `samples` (types in postcard), `retained` (what a
writer keeps and a reader misses), `node` (the bus), `consumer` and `provider` (section 4), `arbiter` (section 5.1.3).
"""
